# SPDX-License-Identifier: MIT
# Images in and out of the tools; needs nothing of the baker.
find_package(OpenEXR 3.1 REQUIRED)
find_package(PkgConfig REQUIRED)
pkg_check_modules(STB REQUIRED IMPORTED_TARGET stb)

relume_room(relume_image_io image_io.cpp)
target_link_libraries(relume_image_io PUBLIC relume::formats PRIVATE OpenEXR::OpenEXR PkgConfig::STB)

# How far apart two images are.
relume_room(relume_image_diff image_diff.cpp perceptual.cpp)
target_link_libraries(relume_image_diff PUBLIC relume_image_io)
