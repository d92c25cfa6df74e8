# SPDX-License-Identifier: MIT
# Cross-build for WebAssembly by emscripten (Debian's 3.1.6 and later): the runtime on the CPU and bindings/js. Preset `wasm`.
find_program(RELUME_EMCC emcc)
if(NOT RELUME_EMCC)
  message(FATAL_ERROR "emcc is missing: install emscripten (Debian: apt-get install --no-install-recommends emscripten), or set RELUME_EMCC")
endif()
execute_process(COMMAND em-config EMSCRIPTEN_ROOT OUTPUT_VARIABLE emscripten_root OUTPUT_STRIP_TRAILING_WHITESPACE RESULT_VARIABLE failed)
if(failed)
  get_filename_component(emscripten_root "${RELUME_EMCC}" REALPATH)
  get_filename_component(emscripten_root "${emscripten_root}" DIRECTORY)
endif()
include(${emscripten_root}/cmake/Modules/Platform/Emscripten.cmake)
# Where Debian keeps what emscripten's own tools import, whichever node runs them.
if(EXISTS /usr/share/nodejs/acorn)
  set(RELUME_WASM_LAUNCH "${CMAKE_COMMAND} -E env NODE_PATH=/usr/share/nodejs")
endif()
# The host's headers of glm, cereal and xxHash; and those that this C++ library lacks, first.
set(CMAKE_CXX_FLAGS_INIT "-idirafter /usr/include")
# Each target says itself whether it is to be small or fast: of two levels emcc mixes what they mean.
set(CMAKE_CXX_FLAGS_RELEASE "-DNDEBUG" CACHE STRING "")
