#pragma once
#include <GL/glcorearb.h>

#include "viewer/gl/gl_context.h"

namespace scanview {

// The functions of OpenGL 3.3 core that we call: (type without PFN and PROC, name without gl).
#define SCANVIEW_GL_FUNCTIONS(X)                        \
  X(GLGETERROR, GetError)                               \
  X(GLGETINTEGERV, GetIntegerv)                         \
  X(GLGETSTRING, GetString)                             \
  X(GLENABLE, Enable)                                   \
  X(GLFINISH, Finish)                                   \
  X(GLDISABLE, Disable)                                 \
  X(GLCULLFACE, CullFace)                               \
  X(GLFRONTFACE, FrontFace)                             \
  X(GLDEPTHFUNC, DepthFunc)                             \
  X(GLVIEWPORT, Viewport)                               \
  X(GLBLENDFUNC, BlendFunc)                             \
  X(GLPOLYGONMODE, PolygonMode)                         \
  X(GLCLEARBUFFERFV, ClearBufferfv)                     \
  X(GLPIXELSTOREI, PixelStorei)                         \
  X(GLREADPIXELS, ReadPixels)                           \
  X(GLREADBUFFER, ReadBuffer)                           \
  X(GLDRAWBUFFERS, DrawBuffers)                         \
  X(GLDRAWARRAYS, DrawArrays)                           \
  X(GLDRAWELEMENTS, DrawElements)                       \
  X(GLGENTEXTURES, GenTextures)                         \
  X(GLDELETETEXTURES, DeleteTextures)                   \
  X(GLBINDTEXTURE, BindTexture)                         \
  X(GLACTIVETEXTURE, ActiveTexture)                     \
  X(GLTEXIMAGE2D, TexImage2D)                           \
  X(GLTEXIMAGE3D, TexImage3D)                           \
  X(GLTEXSUBIMAGE2D, TexSubImage2D)                     \
  X(GLTEXPARAMETERI, TexParameteri)                     \
  X(GLTEXBUFFER, TexBuffer)                             \
  X(GLGENERATEMIPMAP, GenerateMipmap)                   \
  X(GLGENBUFFERS, GenBuffers)                           \
  X(GLDELETEBUFFERS, DeleteBuffers)                     \
  X(GLBINDBUFFER, BindBuffer)                           \
  X(GLBUFFERDATA, BufferData)                           \
  X(GLGENVERTEXARRAYS, GenVertexArrays)                 \
  X(GLDELETEVERTEXARRAYS, DeleteVertexArrays)           \
  X(GLBINDVERTEXARRAY, BindVertexArray)                 \
  X(GLENABLEVERTEXATTRIBARRAY, EnableVertexAttribArray) \
  X(GLVERTEXATTRIBPOINTER, VertexAttribPointer)         \
  X(GLGENFRAMEBUFFERS, GenFramebuffers)                 \
  X(GLDELETEFRAMEBUFFERS, DeleteFramebuffers)           \
  X(GLBINDFRAMEBUFFER, BindFramebuffer)                 \
  X(GLFRAMEBUFFERTEXTURE2D, FramebufferTexture2D)       \
  X(GLFRAMEBUFFERTEXTURELAYER, FramebufferTextureLayer) \
  X(GLBLITFRAMEBUFFER, BlitFramebuffer)                 \
  X(GLCHECKFRAMEBUFFERSTATUS, CheckFramebufferStatus)   \
  X(GLCREATESHADER, CreateShader)                       \
  X(GLDELETESHADER, DeleteShader)                       \
  X(GLSHADERSOURCE, ShaderSource)                       \
  X(GLCOMPILESHADER, CompileShader)                     \
  X(GLGETSHADERIV, GetShaderiv)                         \
  X(GLGETSHADERINFOLOG, GetShaderInfoLog)               \
  X(GLCREATEPROGRAM, CreateProgram)                     \
  X(GLDELETEPROGRAM, DeleteProgram)                     \
  X(GLATTACHSHADER, AttachShader)                       \
  X(GLLINKPROGRAM, LinkProgram)                         \
  X(GLGETPROGRAMIV, GetProgramiv)                       \
  X(GLGETPROGRAMINFOLOG, GetProgramInfoLog)             \
  X(GLUSEPROGRAM, UseProgram)                           \
  X(GLGETUNIFORMLOCATION, GetUniformLocation)           \
  X(GLUNIFORM1I, Uniform1i)                             \
  X(GLUNIFORM1F, Uniform1f)                             \
  X(GLUNIFORM1FV, Uniform1fv)                           \
  X(GLUNIFORM2F, Uniform2f)                             \
  X(GLUNIFORM3F, Uniform3f)                             \
  X(GLUNIFORM3FV, Uniform3fv)                           \
  X(GLUNIFORMMATRIX3FV, UniformMatrix3fv)               \
  X(GLUNIFORMMATRIX4FV, UniformMatrix4fv)

/// Our own loader: epoxy and GLEW do not work on OSMesa. One object a context; plain function pointers.
struct GlFunctions {
#define SCANVIEW_GL_MEMBER(type, name) PFN##type##PROC name = nullptr;
  SCANVIEW_GL_FUNCTIONS(SCANVIEW_GL_MEMBER)
#undef SCANVIEW_GL_MEMBER
  GLint max_texture_size = 0, max_texture_buffer_size = 0, max_array_layers = 0;
};

/// Loads all of them; the context must be current. Throws Error{io} where the context is older than 3.3 or a function
/// is missing (the version is looked at first, because OSMesa answers for names that do not exist).
GlFunctions load_gl_functions(GlContext const& context);

}  // namespace scanview
