# SPDX-License-Identifier: MIT
# cmake --install: what a game links (components runtime and dev, MIT) apart from the tools (component bake) and the baker
# as a library (component bake_dev), both GPL because of CGAL; and the packages that CPack writes of them.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

# Of a version 0.y, each y may break what was linked with the one before.
set(RELUME_SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})

# librelume.so: the runtime in one library that shows nothing but include/relume/.
if(RELUME_BUILD_SHARED AND NOT RELUME_SANITIZE)
  set(map ${PROJECT_SOURCE_DIR}/runtime/relume.map)
  add_library(relume_shared SHARED $<TARGET_OBJECTS:relume_runtime> $<TARGET_OBJECTS:relume_formats>)
  add_library(relume::shared ALIAS relume_shared)
  find_package(glm REQUIRED)
  target_compile_features(relume_shared PUBLIC cxx_std_20)
  target_include_directories(relume_shared PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include>)
  target_link_libraries(relume_shared PUBLIC glm::glm PRIVATE $<BUILD_INTERFACE:relume_xxhash>)
  target_link_options(relume_shared PRIVATE -Wl,--version-script=${map} -Wl,--no-undefined -Wl,--as-needed)
  set_target_properties(relume_shared PROPERTIES EXPORT_NAME shared OUTPUT_NAME relume LINKER_LANGUAGE CXX
    VERSION ${PROJECT_VERSION} SOVERSION ${RELUME_SOVERSION} LINK_DEPENDS ${map})
endif()

# librelume_bake.a: the baker's rooms in one library, which is what relume::bake is outside of this build.
if(RELUME_BUILD_BAKE AND RELUME_INSTALL)
  set(rooms bake_base json scene check_mesh import rays visibility surfels hierarchy lscm caches links reference certificate budget options bake)
  list(TRANSFORM rooms REPLACE "(.+)" "$<TARGET_OBJECTS:relume_\\1>")
  add_library(relume_bake_archive STATIC ${rooms})
  target_compile_features(relume_bake_archive INTERFACE cxx_std_20)
  # The runtime: certificates relight. Names that relumeConfig.cmake finds, and libraries that linkers find.
  target_link_libraries(relume_bake_archive PUBLIC relume_runtime relume_formats
    INTERFACE "$<INSTALL_INTERFACE:$<LINK_ONLY:embree>;$<LINK_ONLY:TBB::tbb>;$<LINK_ONLY:meshoptimizer::meshoptimizer>>"
              "$<INSTALL_INTERFACE:$<LINK_ONLY:flann::flann_cpp>;lz4;draco;stb;gmp;mpfr;xxhash>")
  set_target_properties(relume_bake_archive PROPERTIES EXPORT_NAME bake OUTPUT_NAME relume_bake LINKER_LANGUAGE CXX)
endif()

if(NOT RELUME_INSTALL)
  return()
endif()

# ---- The runtime: libraries, headers, how CMake and pkg-config find them.
set_target_properties(relume_formats PROPERTIES EXPORT_NAME formats)
set_target_properties(relume_runtime PROPERTIES EXPORT_NAME runtime)
install(TARGETS relume_formats relume_runtime EXPORT relumeTargets
        ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT dev)
if(TARGET relume_shared)
  install(TARGETS relume_shared EXPORT relumeTargets
          LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT runtime NAMELINK_COMPONENT dev)
endif()
install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/relume DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT dev
        PATTERN include/relume/bake EXCLUDE)
target_include_directories(relume_formats INTERFACE $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
if(TARGET relume_shared)
  target_include_directories(relume_shared INTERFACE $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
endif()

set(package ${CMAKE_INSTALL_LIBDIR}/cmake/relume)
install(EXPORT relumeTargets NAMESPACE relume:: DESTINATION ${package} COMPONENT dev)
configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/relumeConfig.cmake.in
  ${PROJECT_BINARY_DIR}/relumeConfig.cmake INSTALL_DESTINATION ${package})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/relumeConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/relumeConfig.cmake ${PROJECT_BINARY_DIR}/relumeConfigVersion.cmake
        DESTINATION ${package} COMPONENT dev)
# Found from where the file itself lies, so that an installation can be moved.
file(RELATIVE_PATH RELUME_PC_PREFIX /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
set(RELUME_PC_LIBS -lrelume)
set(RELUME_PC_REQUIRES "")
if(NOT TARGET relume_shared)
  set(RELUME_PC_LIBS "-lrelume_runtime -lrelume_formats -lstdc++ -lm")
  if(NOT RELUME_INLINE_XXHASH)
    set(RELUME_PC_REQUIRES libxxhash)  # of all who link: there is no library that brings it
  endif()
endif()
configure_file(${PROJECT_SOURCE_DIR}/cmake/relume.pc.in ${PROJECT_BINARY_DIR}/relume.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/relume.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT dev)

# ---- The baker as a library, on top of the runtime's files: its headers, and its targets in a file of their own, so that a
# game that asks for the runtime needs no package of the baker's.
if(TARGET relume_bake_archive)
  install(TARGETS relume_bake_archive EXPORT relumeBakeTargets
          ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT bake_dev)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/relume/bake DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/relume COMPONENT bake_dev)
  install(EXPORT relumeBakeTargets NAMESPACE relume:: DESTINATION ${package} COMPONENT bake_dev)
endif()

# ---- The tools.
if(TARGET relume)
  install(TARGETS relume RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT bake)
endif()
if(TARGET relume-view)
  install(TARGETS relume-view RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT bake)
endif()

# ---- Licences, for each package in a folder of its own, with those of the code of others that is in it. What is linked with CGAL says so.
set(docs ${CMAKE_INSTALL_DATAROOTDIR}/doc)
set(RELUME_RUNTIME_PACKAGE librelume${RELUME_SOVERSION})
set(licences ${PROJECT_SOURCE_DIR}/LICENSE ${PROJECT_SOURCE_DIR}/runtime/LICENSE.third-party)
install(FILES ${licences} DESTINATION ${docs}/${RELUME_RUNTIME_PACKAGE} COMPONENT runtime)
install(FILES ${licences} DESTINATION ${docs}/librelume-dev COMPONENT dev)
if(RELUME_BUILD_BAKE)
  list(APPEND licences ${PROJECT_SOURCE_DIR}/bake/LICENSE.binaries)
  if(EXISTS /usr/share/common-licenses/GPL-3)
    list(APPEND licences /usr/share/common-licenses/GPL-3)
  endif()
  install(FILES ${licences} DESTINATION ${docs}/relume-tools COMPONENT bake)
  install(FILES ${licences} DESTINATION ${docs}/librelume-bake-dev COMPONENT bake_dev)
endif()

# ---- Packages: cpack -G DEB in the build folder.
set(CPACK_PACKAGE_NAME relume)
set(CPACK_PACKAGE_VENDOR "The Relume authors")
set(CPACK_PACKAGE_CONTACT "The Relume authors <relume@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "Cached indirect light for games: baker and runtime")
set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
set(CPACK_COMPONENTS_ALL runtime dev)
if(RELUME_BUILD_BAKE)
  list(APPEND CPACK_COMPONENTS_ALL bake bake_dev)
endif()
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR})
set(CPACK_DEBIAN_ENABLE_COMPONENT_DEPENDS OFF)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_NAME ${RELUME_RUNTIME_PACKAGE})
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SECTION libs)
set(CPACK_COMPONENT_RUNTIME_DESCRIPTION "Relume's runtime, which lights levels with their bakes every frame.")
set(CPACK_DEBIAN_DEV_PACKAGE_NAME librelume-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS
    "${RELUME_RUNTIME_PACKAGE} (= ${PROJECT_VERSION}), libglm-dev, libxxhash-dev, pkg-config")
set(CPACK_COMPONENT_DEV_DESCRIPTION "Headers and libraries to link Relume's runtime in C and C++.")
set(CPACK_DEBIAN_BAKE_PACKAGE_NAME relume-tools)
set(CPACK_DEBIAN_BAKE_PACKAGE_SECTION graphics)
set(CPACK_COMPONENT_BAKE_DESCRIPTION "The command line that bakes, checks and compares, and the viewer. GPL-3.0-or-later.")
set(CPACK_DEBIAN_BAKE_DEV_PACKAGE_NAME librelume-bake-dev)
set(CPACK_DEBIAN_BAKE_DEV_PACKAGE_SECTION libdevel)
string(CONCAT CPACK_DEBIAN_BAKE_DEV_PACKAGE_DEPENDS "librelume-dev (= ${PROJECT_VERSION}), libembree-dev, libtbb-dev, "
  "libmeshoptimizer-dev, libflann-dev, liblz4-dev, libdraco-dev, libstb-dev, libgmp-dev, libmpfr-dev, libxxhash-dev")
set(CPACK_COMPONENT_BAKE_DEV_DESCRIPTION "Headers and library to bake from programs of one's own. GPL-3.0-or-later.")
include(CPack)
