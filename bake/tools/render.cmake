# SPDX-License-Identifier: MIT
# Drawing a camera's view with a bake: relume_render, for the command line and the tests.
relume_room(relume_render render_frame.cpp render_cpu.cpp)
target_link_libraries(relume_render PUBLIC relume::bake relume::runtime)
if(RELUME_BUILD_GL)
  target_sources(relume_render PRIVATE render_gl.cpp)
  target_link_libraries(relume_render PRIVATE relume_egl relume_gl_level)
  target_compile_definitions(relume_render PUBLIC RELUME_RENDER_GL)
endif()
