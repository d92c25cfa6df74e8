// SPDX-License-Identifier: MIT
// The bodies of libraries that are headers alone: the glTF parser, image files in and out.
#define TINYGLTF_IMPLEMENTATION
#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_WRITE_IMPLEMENTATION
#include <tiny_gltf.h>
