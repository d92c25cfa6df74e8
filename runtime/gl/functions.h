// SPDX-License-Identifier: MIT
// The OpenGL functions that the backend calls, as the host's getProcAddress gives them for the context that is current.
// Each backend has a table of its own: nothing is global, and addresses of one context are never used in another. No
// other file asks for a function, so that the library links no OpenGL.
#pragma once

#include "relume/relighter.h"
#include "relume/result.h"

#include <GL/glcorearb.h>

// winnt.h has a macro of this name, and glcorearb.h includes it on Windows.
#ifdef MemoryBarrier
#undef MemoryBarrier
#endif

namespace relume::gl {

// Every function of the passes: its name without gl, and the same in capitals, as glcorearb.h has it in the pointer's
// type. All are in OpenGL 4.3 core.
#define RELUME_GL_FUNCTIONS(X)                        \
  X(ActiveTexture, ACTIVETEXTURE)                     \
  X(AttachShader, ATTACHSHADER)                       \
  X(BindBuffer, BINDBUFFER)                           \
  X(BindBufferBase, BINDBUFFERBASE)                   \
  X(BindBufferRange, BINDBUFFERRANGE)                 \
  X(BindImageTexture, BINDIMAGETEXTURE)               \
  X(BindSampler, BINDSAMPLER)                         \
  X(BindTexture, BINDTEXTURE)                         \
  X(BufferData, BUFFERDATA)                           \
  X(BufferSubData, BUFFERSUBDATA)                     \
  X(ClearBufferData, CLEARBUFFERDATA)                 \
  X(CompileShader, COMPILESHADER)                     \
  X(CopyBufferSubData, COPYBUFFERSUBDATA)             \
  X(CopyImageSubData, COPYIMAGESUBDATA)               \
  X(CreateProgram, CREATEPROGRAM)                     \
  X(CreateShader, CREATESHADER)                       \
  X(DeleteBuffers, DELETEBUFFERS)                     \
  X(DeleteProgram, DELETEPROGRAM)                     \
  X(DeleteSamplers, DELETESAMPLERS)                   \
  X(DeleteQueries, DELETEQUERIES)                     \
  X(DeleteShader, DELETESHADER)                       \
  X(DeleteTextures, DELETETEXTURES)                   \
  X(DetachShader, DETACHSHADER)                       \
  X(DispatchCompute, DISPATCHCOMPUTE)                 \
  X(DispatchComputeIndirect, DISPATCHCOMPUTEINDIRECT) \
  X(GenBuffers, GENBUFFERS)                           \
  X(GenQueries, GENQUERIES)                           \
  X(GenSamplers, GENSAMPLERS)                         \
  X(GenTextures, GENTEXTURES)                         \
  X(GetActiveUniform, GETACTIVEUNIFORM)               \
  X(GetBufferSubData, GETBUFFERSUBDATA)               \
  X(GetError, GETERROR)                               \
  X(GetInteger64i_v, GETINTEGER64I_V)                 \
  X(GetInteger64v, GETINTEGER64V)                     \
  X(GetIntegeri_v, GETINTEGERI_V)                     \
  X(GetIntegerv, GETINTEGERV)                         \
  X(GetProgramInfoLog, GETPROGRAMINFOLOG)             \
  X(GetProgramiv, GETPROGRAMIV)                       \
  X(GetProgramInterfaceiv, GETPROGRAMINTERFACEIV)     \
  X(GetProgramResourceiv, GETPROGRAMRESOURCEIV)       \
  X(GetProgramResourceName, GETPROGRAMRESOURCENAME)   \
  X(GetQueryObjectiv, GETQUERYOBJECTIV)               \
  X(GetQueryObjectui64v, GETQUERYOBJECTUI64V)         \
  X(GetShaderInfoLog, GETSHADERINFOLOG)               \
  X(GetShaderiv, GETSHADERIV)                         \
  X(GetString, GETSTRING)                             \
  X(GetStringi, GETSTRINGI)                           \
  X(GetTexImage, GETTEXIMAGE)                         \
  X(GetTexLevelParameteriv, GETTEXLEVELPARAMETERIV)   \
  X(GetUniformLocation, GETUNIFORMLOCATION)           \
  X(GetUniformiv, GETUNIFORMIV)                       \
  X(IsBuffer, ISBUFFER)                               \
  X(IsProgram, ISPROGRAM)                             \
  X(IsSampler, ISSAMPLER)                             \
  X(IsTexture, ISTEXTURE)                             \
  X(LinkProgram, LINKPROGRAM)                         \
  X(MemoryBarrier, MEMORYBARRIER)                     \
  X(PixelStorei, PIXELSTOREI)                         \
  X(ProgramUniform1f, PROGRAMUNIFORM1F)               \
  X(ProgramUniform1i, PROGRAMUNIFORM1I)               \
  X(ProgramUniform1ui, PROGRAMUNIFORM1UI)             \
  X(ProgramUniform2f, PROGRAMUNIFORM2F)               \
  X(ProgramUniform2i, PROGRAMUNIFORM2I)               \
  X(ProgramUniform2ui, PROGRAMUNIFORM2UI)             \
  X(ProgramUniform3f, PROGRAMUNIFORM3F)               \
  X(ProgramUniform3fv, PROGRAMUNIFORM3FV)             \
  X(ProgramUniform3ui, PROGRAMUNIFORM3UI)             \
  X(ProgramUniformMatrix4fv, PROGRAMUNIFORMMATRIX4FV) \
  X(QueryCounter, QUERYCOUNTER)                       \
  X(SamplerParameteri, SAMPLERPARAMETERI)             \
  X(ShaderSource, SHADERSOURCE)                       \
  X(TexParameteri, TEXPARAMETERI)                     \
  X(TexStorage2D, TEXSTORAGE2D)                       \
  X(TexStorage3D, TEXSTORAGE3D)                       \
  X(TexSubImage2D, TEXSUBIMAGE2D)                     \
  X(TexSubImage3D, TEXSUBIMAGE3D)                     \
  X(UseProgram, USEPROGRAM)

// None is null once loadFunctions() has made it. Handles (handle.h) point to the table that they were made with, which
// has to outlive them and stay where it is.
struct Functions {
#define RELUME_GL_POINTER(name, NAME) PFNGL##NAME##PROC name = nullptr;
  RELUME_GL_FUNCTIONS(RELUME_GL_POINTER)
#undef RELUME_GL_POINTER
  bool hasQueryBuffer = false;  // whether there is a GL_QUERY_BUFFER: OpenGL 4.4, ARB_query_buffer_object
};

// What drawing needs in addition, for tools: no pass of the backends draws. All are in OpenGL 4.3 core.
#define RELUME_GL_DRAW_FUNCTIONS(X)                                   \
  X(BindFramebuffer, BINDFRAMEBUFFER)                                 \
  X(BindVertexArray, BINDVERTEXARRAY)                                 \
  X(BindVertexBuffer, BINDVERTEXBUFFER)                               \
  X(BlendEquationSeparatei, BLENDEQUATIONSEPARATEI)                   \
  X(BlendFuncSeparatei, BLENDFUNCSEPARATEI)                           \
  X(CheckFramebufferStatus, CHECKFRAMEBUFFERSTATUS)                   \
  X(ClearBufferfv, CLEARBUFFERFV)                                     \
  X(ClearBufferuiv, CLEARBUFFERUIV)                                   \
  X(ColorMaski, COLORMASKI)                                           \
  X(DeleteFramebuffers, DELETEFRAMEBUFFERS)                           \
  X(DeleteVertexArrays, DELETEVERTEXARRAYS)                           \
  X(Disable, DISABLE)                                                 \
  X(Disablei, DISABLEI)                                               \
  X(DrawArraysInstancedBaseInstance, DRAWARRAYSINSTANCEDBASEINSTANCE) \
  X(DrawBuffers, DRAWBUFFERS)                                         \
  X(Enable, ENABLE)                                                   \
  X(Enablei, ENABLEI)                                                 \
  X(EnableVertexAttribArray, ENABLEVERTEXATTRIBARRAY)                 \
  X(FramebufferTexture2D, FRAMEBUFFERTEXTURE2D)                       \
  X(GenFramebuffers, GENFRAMEBUFFERS)                                 \
  X(GenVertexArrays, GENVERTEXARRAYS)                                 \
  X(GetBooleani_v, GETBOOLEANI_V)                                     \
  X(GetFloati_v, GETFLOATI_V)                                         \
  X(IsEnabled, ISENABLED)                                             \
  X(IsEnabledi, ISENABLEDI)                                           \
  X(PolygonMode, POLYGONMODE)                                         \
  X(ProgramUniform2f, PROGRAMUNIFORM2F)                               \
  X(TexImage2D, TEXIMAGE2D)                                           \
  X(VertexAttribBinding, VERTEXATTRIBBINDING)                         \
  X(VertexAttribFormat, VERTEXATTRIBFORMAT)                           \
  X(VertexAttribIFormat, VERTEXATTRIBIFORMAT)                         \
  X(VertexBindingDivisor, VERTEXBINDINGDIVISOR)                       \
  X(ViewportIndexedfv, VIEWPORTINDEXEDFV)

struct DrawFunctions {
#define RELUME_GL_POINTER(name, NAME) PFNGL##NAME##PROC name = nullptr;
  RELUME_GL_DRAW_FUNCTIONS(RELUME_GL_POINTER)
#undef RELUME_GL_POINTER
  PFNGLCLIPCONTROLPROC ClipControl = nullptr;  // null before OpenGL 4.5
};

// The functions of the context that is current, which is asked for its version and, once it has them all, for its
// extensions.
// usage: getProcAddress is empty; unsupported: no context, one older than OpenGL 4.3 or of OpenGL ES, a function that
// getProcAddress does not know (the message names it).
Result<Functions> loadFunctions(const GetProcAddress& getProcAddress);
// Those of the same context, once loadFunctions() has taken it. unsupported: a function that getProcAddress does not
// know.
Result<DrawFunctions> loadDrawFunctions(const GetProcAddress& getProcAddress, const Functions& gl);

}  // namespace relume::gl
