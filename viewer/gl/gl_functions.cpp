#include "viewer/gl/gl_functions.h"

#include <string>

#include "base/error.h"

namespace scanview {

GlFunctions load_gl_functions(GlContext const& context) {
  GlFunctions gl;
#define SCANVIEW_GL_LOAD(type, name) gl.name = reinterpret_cast<PFN##type##PROC>(context.get_proc("gl" #name));
  SCANVIEW_GL_LOAD(GLGETINTEGERV, GetIntegerv)
  if (gl.GetIntegerv == nullptr) throw Error(ErrorCode::io, {}, "OpenGL: glGetIntegerv is missing");
  GLint major = 0, minor = 0;
  gl.GetIntegerv(GL_MAJOR_VERSION, &major);
  gl.GetIntegerv(GL_MINOR_VERSION, &minor);
  if (major * 10 + minor < 33) {
    throw Error(ErrorCode::io, {},
                "OpenGL 3.3 is needed; this context has " + std::to_string(major) + "." + std::to_string(minor));
  }
  SCANVIEW_GL_FUNCTIONS(SCANVIEW_GL_LOAD)
#undef SCANVIEW_GL_LOAD
#define SCANVIEW_GL_CHECK(type, name) \
  if (gl.name == nullptr) throw Error(ErrorCode::io, {}, "OpenGL: gl" #name " is missing");
  SCANVIEW_GL_FUNCTIONS(SCANVIEW_GL_CHECK)
#undef SCANVIEW_GL_CHECK
  gl.GetIntegerv(GL_MAX_TEXTURE_SIZE, &gl.max_texture_size);
  gl.GetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &gl.max_texture_buffer_size);
  gl.GetIntegerv(GL_MAX_ARRAY_TEXTURE_LAYERS, &gl.max_array_layers);
  return gl;
}

}  // namespace scanview
