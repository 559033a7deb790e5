#include "viewer/gl/gl_objects.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/error.h"

namespace scanview {
namespace {

class Shader {
 public:
  Shader(GlFunctions const& gl, GLenum kind, std::string const& source) : gl_(gl), name_(gl.CreateShader(kind)) {
    char const* const text = source.c_str();
    gl_.ShaderSource(name_, 1, &text, nullptr);
    gl_.CompileShader(name_);
    GLint compiled = 0;
    gl_.GetShaderiv(name_, GL_COMPILE_STATUS, &compiled);
    if (compiled == 0) {
      GLint length = 0;
      gl_.GetShaderiv(name_, GL_INFO_LOG_LENGTH, &length);
      std::string log(static_cast<std::size_t>(std::max(length, 1)), '\0');
      gl_.GetShaderInfoLog(name_, length, nullptr, log.data());
      gl_.DeleteShader(name_);
      throw Error(ErrorCode::io, {}, std::string("OpenGL: a shader does not compile: ") + log.c_str());
    }
  }
  ~Shader() { gl_.DeleteShader(name_); }
  Shader(Shader const&) = delete;
  Shader& operator=(Shader const&) = delete;
  GLuint name() const { return name_; }

 private:
  GlFunctions const& gl_;
  GLuint name_;
};

}  // namespace

GlProgram::GlProgram(GlFunctions const& gl, std::string const& vertex_source, std::string const& fragment_source)
    : gl_(gl) {
  Shader const vertex(gl, GL_VERTEX_SHADER, vertex_source);
  Shader const fragment(gl, GL_FRAGMENT_SHADER, fragment_source);
  name_ = gl_.CreateProgram();
  gl_.AttachShader(name_, vertex.name());
  gl_.AttachShader(name_, fragment.name());
  gl_.LinkProgram(name_);
  GLint linked = 0;
  gl_.GetProgramiv(name_, GL_LINK_STATUS, &linked);
  if (linked == 0) {
    GLint length = 0;
    gl_.GetProgramiv(name_, GL_INFO_LOG_LENGTH, &length);
    std::string log(static_cast<std::size_t>(std::max(length, 1)), '\0');
    gl_.GetProgramInfoLog(name_, length, nullptr, log.data());
    gl_.DeleteProgram(name_);
    throw Error(ErrorCode::io, {}, std::string("OpenGL: shaders do not link: ") + log.c_str());
  }
}

GlProgram::~GlProgram() { gl_.DeleteProgram(name_); }

void GlProgram::use() const { gl_.UseProgram(name_); }

GLint GlProgram::uniform(char const* name) const { return gl_.GetUniformLocation(name_, name); }

void check_gl(GlFunctions const& gl, char const* what) {
  GLenum const first = gl.GetError();
  if (first == GL_NO_ERROR) return;
  // Older errors would otherwise be blamed on the next check; a lost context reports for ever.
  for (int i = 0; i < 16 && gl.GetError() != GL_NO_ERROR; ++i) {
  }
  throw Error(ErrorCode::io, {},
              first == GL_OUT_OF_MEMORY ? fmt::format("OpenGL: out of memory at {}", what)
                                        : fmt::format("OpenGL: error {:#06x} at {}", first, what));
}

}  // namespace scanview
