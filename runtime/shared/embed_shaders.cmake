# SPDX-License-Identifier: MIT
# cmake -DOUTPUT=file -DROOT=shaders -DFILES=a;b [-DSTRIP=1] -P embed_shaders.cmake: writes the sources as C++ string literals,
# without comments where STRIP asks for it.
set(text "// Made from shaders/ by embed_shaders.cmake.\n#include \"runtime/shared/shader_text.h\"\n\n#include <array>\n\n")
string(APPEND text "namespace relume {\n\nstd::span<const EmbeddedShader> embeddedShaders() {\n")
list(LENGTH FILES count)
string(APPEND text "  static constexpr std::array<EmbeddedShader, ${count}> kShaders = {{\n")
foreach(file ${FILES})
  file(READ ${ROOT}/${file} source)
  if(STRIP)
    string(REGEX REPLACE " *//[^\n]*" "" source "${source}")
    string(REGEX REPLACE "\n\n+" "\n" source "${source}")
  endif()
  string(APPEND text "      {\"${file}\", R\"glsl(${source})glsl\"},\n")
endforeach()
string(APPEND text "  }};\n  return kShaders;\n}\n\n}  // namespace relume\n")
file(WRITE ${OUTPUT} "${text}")
