# SPDX-License-Identifier: MIT
# relume_library(name [ALIAS relume::x]) and relume_warnings(target): the flags every target of ours shares.

# What a game that adds this folder compiles itself with does not reach us: errors of packages end as exceptions, and NaN in what a host
# hands over is refused.
if(NOT EMSCRIPTEN)
  add_compile_options($<$<COMPILE_LANGUAGE:CXX>:-fexceptions> $<$<COMPILE_LANGUAGE:CXX>:-frtti> -fno-fast-math)
endif()
# Contraction into fused multiply-adds differs between instruction sets; the same input must give the same bytes.
add_compile_options(-ffp-contract=off)
# Nobody reads errno or floating-point traps: roots, floors and selects become single instructions, with the same results.
add_compile_options(-fno-math-errno -fno-trapping-math)
# g++ looks for memory to give back each time its heap has grown to 128 MiB and more, which a precompiled header fills by itself. At
# 500 MiB next to no file is looked through: 3 to 17 % of the time that one takes, for a sixth more memory. The code is the same.
add_compile_options($<$<CXX_COMPILER_ID:GNU>:--param=ggc-min-heapsize=500000>)
# WebAssembly: its own exceptions, which cost nothing until they are thrown; no names of types, which pages would download and nobody
# reads; and headers that its C++ library lacks.
if(EMSCRIPTEN)
  add_compile_options(-fwasm-exceptions -fno-rtti -isystem ${PROJECT_SOURCE_DIR}/cmake/emscripten)
  add_link_options(-fwasm-exceptions)
endif()
# The first finding ends a program: code that never goes on after one takes a third less time.
if(RELUME_SANITIZE)
  add_compile_options(-fsanitize=${RELUME_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer)
  add_link_options(-fsanitize=${RELUME_SANITIZE})
  # A hundred programs, each with the sanitizer's library: by lld in a third of the time.
  include(CheckLinkerFlag)
  check_linker_flag(CXX -fuse-ld=lld RELUME_HAS_LLD)
  if(RELUME_HAS_LLD)
    add_link_options(-fuse-ld=lld)
  endif()
  # What the address sanitizer stops at too, where memory is touched, or what needs casts between classes, of which there are next to
  # none: a tenth of the time that a build takes.
  if(RELUME_SANITIZE MATCHES "address" AND RELUME_SANITIZE MATCHES "undefined")
    add_compile_options(-fno-sanitize=null,object-size,vptr)
  endif()
endif()

# libFuzzer steers by the coverage of the code that it tests, this folder's. The mutators know the formats, so comparisons need
# not be traced, which costs a quarter of the time.
macro(relume_steers_fuzzers)
  if(RELUME_BUILD_FUZZERS)
    add_compile_options(-fsanitize-coverage=inline-8bit-counters,pc-table)
  endif()
endmacro()

function(relume_warnings target)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wshadow -Wnon-virtual-dtor -Wno-psabi)
  # GCC 12 sees overlapping copies in "literal" + std::string (GCC bug 105651).
  target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>)
  if(RELUME_WARNINGS_AS_ERRORS)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
endfunction()

# For what goes into a game: numbers change their type by casts alone, which say so.
function(relume_conversion_warnings target)
  target_compile_options(${target} PRIVATE -Wconversion -Wsign-conversion)
endfunction()

# Of "literal" + std::string again: g++ forgets that a precompiled header is the system's.
function(relume_precompiled_warnings target)
  target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-array-bounds;-Wno-stringop-overflow;-Wno-stringop-overread>)
endfunction()

# The headers that most rooms include, parsed once for all of them: more than a quarter of the time that a file takes. Compiler caches do
# not look through precompiled headers unless they are told to, so a build with a launcher goes without, and shows where a
# file lacks an include. Files with flags of their own (instruction sets) go without as well: SKIP_PRECOMPILE_HEADERS.
function(relume_reuse_room_headers target)
  if(CMAKE_CXX_COMPILER_LAUNCHER OR EMSCRIPTEN OR CMAKE_CROSSCOMPILING OR NOT PROJECT_IS_TOP_LEVEL)
    return()
  endif()
  if(NOT TARGET relume_room_headers)
    file(WRITE ${PROJECT_BINARY_DIR}/room_headers.cpp "")
    add_library(relume_room_headers STATIC EXCLUDE_FROM_ALL ${PROJECT_BINARY_DIR}/room_headers.cpp)
    target_compile_features(relume_room_headers PUBLIC cxx_std_20)
    target_precompile_headers(relume_room_headers PRIVATE <glm/geometric.hpp> <glm/vec2.hpp> <glm/vec3.hpp> <glm/vec4.hpp>
      <algorithm> <array> <atomic> <cmath> <cstddef> <cstdint> <cstring> <functional> <limits> <memory> <memory_resource> <mutex>
      <numeric> <optional> <span> <string> <string_view> <type_traits> <utility> <variant> <vector>)
  endif()
  target_precompile_headers(${target} REUSE_FROM relume_room_headers)
  relume_precompiled_warnings(${target})
endfunction()

# A room of the house: a static library whose headers are included from the project's root.
function(relume_room target)
  add_library(${target} STATIC ${ARGN})
  target_include_directories(${target} PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include>
                                              $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>)
  relume_warnings(${target})
  relume_reuse_room_headers(${target})
  relume_compile_together(${target})
  # Pages load it: small, but for the kernels, which bindings/js compiles again.
  if(EMSCRIPTEN)
    target_compile_options(${target} PRIVATE -Oz)
  endif()
endfunction()

# For code that is much of what is compiled and little of what runs: with less optimisation it takes a third less time to
# build, half of it with the many checks of the address sanitizer.
function(relume_little_optimisation target)
  if(RELUME_SANITIZE MATCHES "address")
    target_compile_options(${target} PRIVATE -O0)
  else()
    target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-Og>)
  endif()
endfunction()

# For rooms that are mostly the reading and writing of JSON: most of what the sanitizers' compiler does there are checks of
# another library's templates. As other flags than the room headers have, without those.
function(relume_little_optimisation_of_json target)
  if(RELUME_SANITIZE MATCHES "address")
    target_compile_options(${target} PRIVATE -O0)
    set_target_properties(${target} PROPERTIES DISABLE_PRECOMPILE_HEADERS ON)
  endif()
endfunction()

# How the code of tests is compiled.
function(relume_test_options target)
  relume_little_optimisation(${target})
  relume_warnings(${target})
endfunction()

# The headers that most tests include, parsed once for all of them. Compiler caches do not look through precompiled headers
# unless they are told to, so a build with a launcher goes without, and shows where a test lacks an include.
function(relume_reuse_test_headers target)
  if(CMAKE_CXX_COMPILER_LAUNCHER)
    return()
  endif()
  if(NOT TARGET relume_test_headers)
    file(WRITE ${PROJECT_BINARY_DIR}/test_headers.cpp "")
    # A program, as the tests are: libraries are compiled for other addresses.
    add_executable(relume_test_headers EXCLUDE_FROM_ALL ${PROJECT_BINARY_DIR}/test_headers.cpp)
    target_link_libraries(relume_test_headers PRIVATE relume::formats GTest::gtest_main)
    relume_test_options(relume_test_headers)
    target_precompile_headers(relume_test_headers PRIVATE <gtest/gtest.h> <glm/geometric.hpp> <algorithm> <array> <cmath>
      <cstdint> <cstdio> <cstdlib> <cstring> <filesystem> <fstream> <functional> <limits> <map> <numbers> <random> <set> <string>
      <utility> <vector>)
  endif()
  target_precompile_headers(${target} REUSE_FROM relume_test_headers)
  relume_precompiled_warnings(${target})
endfunction()

# Several files at a time, where what takes the time is headers that are larger than the files: a half of it. As with precompiled
# headers, builds with a launcher compile each file by itself: a change compiles that file alone, and an include that is missing
# shows. RELUME_FILE_BY_FILE: so does a build whose compile commands tools read, such as tests/tidy.sh.
function(relume_compile_together target)
  get_target_property(sources ${target} SOURCES)
  list(LENGTH sources count)
  if(count GREATER 1 AND NOT CMAKE_CXX_COMPILER_LAUNCHER AND NOT RELUME_FILE_BY_FILE)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 8)
  endif()
endfunction()

# How command lines are compiled: what takes their time is the library that reads options, and none of it is worth much
# optimisation. Its headers are parsed once for the whole program, by the same rule as those of tests.
function(relume_command_line target)
  relume_little_optimisation(${target})
  relume_compile_together(${target})
  if(NOT CMAKE_CXX_COMPILER_LAUNCHER)
    target_precompile_headers(${target} PRIVATE <CLI/CLI.hpp> ${ARGN})
  endif()
endfunction()

# What a test takes at most where nothing else runs [s]. What ends it is four times that: a test that hangs, not one that is slow.
function(relume_test_limit name seconds)
  math(EXPR limit "4 * ${seconds}")
  set_tests_properties(${name} PROPERTIES TIMEOUT ${limit})
endfunction()

# Register a test by its command; `timeout` [s] is that limit, and may be empty. Files of two builds' tests, which may run at once, stay apart.
function(relume_add_test name timeout)
  set(temporary ${PROJECT_BINARY_DIR}/temporary)
  file(MAKE_DIRECTORY ${temporary})
  add_test(NAME ${name} COMMAND ${ARGN})
  set_tests_properties(${name} PROPERTIES ENVIRONMENT "TMPDIR=${temporary};TEST_TMPDIR=${temporary}")
  # What may take long starts first, so that no processor waits for the last one.
  if(timeout)
    relume_test_limit(${name} ${timeout})
    set_tests_properties(${name} PROPERTIES COST ${timeout})
  endif()
endfunction()

# One of these cases of a google-test program alone. A case that is not there is no case that passed.
function(relume_add_test_of_cases name timeout program)
  list(JOIN ARGN ":" cases)
  relume_add_test(${name} "${timeout}" ${program} --gtest_filter=${cases})
  list(LENGTH ARGN count)
  math(EXPR last "${count} - 1")
  foreach(i RANGE ${last})
    list(APPEND fewer ${i})
  endforeach()
  list(JOIN fewer "|" fewer)
  set_tests_properties(${name} PROPERTIES FAIL_REGULAR_EXPRESSION "Running (${fewer}) tests? from")
endfunction()

# A google-test program named test_<name>, registered with ctest. Target relume_tests builds all of them but those of
# NUMBERS, and nothing else.
# NUMBERS: it measures at length what code gives that other tests walk as well; target relume_numbers builds it, and the
# sanitizers see it in long runs alone (label `numbers`). LENGTHY: cases of which the same is true; they are test
# <name>_at_length. LONG: the release suite sees those cases in long runs alone as
# well (label `long`); without any of LENGTHY, all of NUMBERS.
# THREADS: the cases that run on more than one thread, all that the sanitizer of threads sees.
# UNSANITIZED: cases that are the release build's, and the sanitizers' in long runs alone: they take these long, and walk
# what others do.
# FAULTS: what becomes of bad input and of systems that fail. Where the sanitizers see it the release suite need not, but in
# long runs (label `faults`).
# COMMANDS: it runs program `relume`, which is built before it, as users do; its path is RELUME_BINARY. Such tests, and those of the
# rooms that draw and compare (RELUME_TOOL_ROOMS), are the release build's: label `tools`. What commands call the sanitizers see in
# tests of its room, and the programs themselves in long runs. UNSANITIZED says nothing more of them.
# TOGETHER: the program is test_<TOGETHER>, which other tests of the room share: their headers are parsed once, which is most of what a file
# of a test costs, and it is linked once. Those that measure (NUMBERS) share none with the others, as not every build has them.
set(RELUME_TOOL_ROOMS relume_render relume_compare relume_lights_file relume_viewer relume_gl_scene relume_gl_splat)
function(relume_test name)
  cmake_parse_arguments(T "NUMBERS;LONG;FAULTS;COMMANDS" "TIMEOUT;TOGETHER" "SOURCES;LIBS;LENGTHY;UNSANITIZED;THREADS" ${ARGN})
  if(RELUME_SANITIZE)
    list(APPEND T_LENGTHY ${T_UNSANITIZED})
  endif()
  if(RELUME_SANITIZE STREQUAL "thread" AND NOT T_THREADS)
    return()
  endif()
  set(program test_${name})
  set(cases "")
  if(T_TOGETHER)
    set(program test_${T_TOGETHER})
    foreach(source ${T_SOURCES})
      if(source MATCHES "_test\\.cpp$")
        list(APPEND cases --of ${source})
      endif()
    endforeach()
  endif()
  if(TARGET ${program})
    target_sources(${program} PRIVATE ${T_SOURCES})
  else()
    add_executable(${program} ${T_SOURCES})
    target_link_libraries(${program} PRIVATE GTest::gtest)
    target_include_directories(${program} PRIVATE ${PROJECT_SOURCE_DIR})
    target_compile_definitions(${program} PRIVATE RELUME_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
    relume_test_options(${program})
    relume_reuse_test_headers(${program})
    if(T_TOGETHER)
      target_link_libraries(${program} PRIVATE relume_run_cases)
    else()
      target_link_libraries(${program} PRIVATE GTest::gtest_main)
    endif()
  endif()
  target_link_libraries(${program} PRIVATE ${T_LIBS})
  relume_compile_together(${program})
  set(tools ${T_COMMANDS})
  foreach(room ${RELUME_TOOL_ROOMS})
    if(room IN_LIST T_LIBS)
      set(tools TRUE)
    endif()
  endforeach()
  if(T_COMMANDS)
    add_dependencies(${program} relume)
    target_compile_definitions(${program} PRIVATE RELUME_BINARY="$<TARGET_FILE:relume>")
  endif()
  set(labels numbers)
  if(T_LONG)
    list(APPEND labels long)
  endif()
  if(T_NUMBERS OR (tools AND RELUME_SANITIZE))
    add_dependencies(relume_numbers ${program})
  else()
    add_dependencies(relume_tests ${program})
  endif()
  if(RELUME_SANITIZE STREQUAL "thread")
    relume_add_test_of_cases(${name} "${T_TIMEOUT}" ${program} ${T_THREADS})
  elseif(T_LENGTHY)
    list(JOIN T_LENGTHY ":" lengthy)
    relume_add_test(${name} "${T_TIMEOUT}" ${program} ${cases} --gtest_filter=-${lengthy})
    relume_add_test_of_cases(${name}_at_length "${T_TIMEOUT}" ${program} ${T_LENGTHY})
    set_tests_properties(${name}_at_length PROPERTIES LABELS "${labels}")
  else()
    relume_add_test(${name} "${T_TIMEOUT}" ${program} ${cases})
  endif()
  if(T_NUMBERS AND T_LENGTHY)
    set_tests_properties(${name} PROPERTIES LABELS numbers)
  elseif(T_NUMBERS)
    set_tests_properties(${name} PROPERTIES LABELS "${labels}")
  elseif(T_FAULTS)
    set_tests_properties(${name} PROPERTIES LABELS faults)
  elseif(tools)
    set_tests_properties(${name} PROPERTIES LABELS tools)
  endif()
endfunction()

# bench_<name>, a program that prints tables of docs/notes: no test, and built by target relume_benchmarks or its own alone.
function(relume_benchmark name)
  cmake_parse_arguments(B "" "" "SOURCES;LIBS" ${ARGN})
  add_executable(bench_${name} EXCLUDE_FROM_ALL ${B_SOURCES})
  target_link_libraries(bench_${name} PRIVATE ${B_LIBS})
  target_include_directories(bench_${name} PRIVATE ${PROJECT_SOURCE_DIR})
  relume_warnings(bench_${name})
  add_dependencies(relume_benchmarks bench_${name})
endfunction()
