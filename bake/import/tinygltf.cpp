// SPDX-License-Identifier: MIT
// The implementation of tinygltf, compiled here and not taken from its shared library: libdraco exports another
// version's symbols by the same names, and which of the two a program got would depend on the order of its libraries.
// Images are decoded by read_images.cpp; tinygltf's own loader and writer are replaced in gltf_document.cpp and never
// run.
#define STB_IMAGE_STATIC
#define STB_IMAGE_WRITE_STATIC
#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_WRITE_IMPLEMENTATION
#define TINYGLTF_IMPLEMENTATION
#include <tiny_gltf.h>
