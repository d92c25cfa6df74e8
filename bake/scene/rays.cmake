# SPDX-License-Identifier: MIT
# Rays against a scene, and the walks that find which surfaces matter.
find_package(embree 3.13 REQUIRED)

relume_room(relume_rays ray_tracer.cpp ray_tracer_name.cpp build_rays.cpp ray_overlaps.cpp ray_piles.cpp ray_fan.cpp build_fan.cpp
            fan_baseline.cpp)
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64|amd64")
  target_sources(relume_rays PRIVATE fan_avx2.cpp)
  set_source_files_properties(fan_avx2.cpp PROPERTIES COMPILE_OPTIONS "-mavx2;-mpopcnt;-mbmi")
  target_compile_definitions(relume_rays PRIVATE RELUME_X86_FANS)
endif()
target_link_libraries(relume_rays PUBLIC relume_scene PRIVATE embree)

relume_room(relume_play_space play_space.cpp find_starts.cpp seen_cells.cpp cell_tree.cpp keep_cells.cpp)
target_link_libraries(relume_play_space PUBLIC relume_rays)
