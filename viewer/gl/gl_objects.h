#pragma once
#include <string>
#include <utility>

#include "viewer/gl/gl_functions.h"

namespace scanview {

/// Names of OpenGL objects that delete themselves. The context they were made in must be current when they are made,
/// used and destroyed, and the GlFunctions must outlive them.
template <typename Traits>
class GlObject {
 public:
  GlObject() = default;
  explicit GlObject(GlFunctions const& gl) : gl_(&gl) { Traits::create(gl, &name_); }
  GlObject(GlObject&& other) noexcept : gl_(other.gl_), name_(std::exchange(other.name_, 0)) {}
  GlObject& operator=(GlObject&& other) noexcept {
    std::swap(gl_, other.gl_);
    std::swap(name_, other.name_);
    return *this;
  }
  ~GlObject() {
    if (name_ != 0) Traits::destroy(*gl_, &name_);
  }
  GLuint name() const { return name_; }

 private:
  GlFunctions const* gl_ = nullptr;
  GLuint name_ = 0;
};

#define SCANVIEW_GL_OBJECT(type, Plural)                                                     \
  struct type##Traits {                                                                      \
    static void create(GlFunctions const& gl, GLuint* name) { gl.Gen##Plural(1, name); }     \
    static void destroy(GlFunctions const& gl, GLuint* name) { gl.Delete##Plural(1, name); } \
  };                                                                                         \
  using type = GlObject<type##Traits>;
SCANVIEW_GL_OBJECT(GlTexture, Textures)
SCANVIEW_GL_OBJECT(GlBuffer, Buffers)
SCANVIEW_GL_OBJECT(GlVertexArray, VertexArrays)
SCANVIEW_GL_OBJECT(GlFramebuffer, Framebuffers)
#undef SCANVIEW_GL_OBJECT

/// A linked program. Throws Error{io} with the driver's log where a shader does not compile or link.
class GlProgram {
 public:
  GlProgram(GlFunctions const& gl, std::string const& vertex_source, std::string const& fragment_source);
  ~GlProgram();
  GlProgram(GlProgram const&) = delete;
  GlProgram& operator=(GlProgram const&) = delete;
  void use() const;
  GLint uniform(char const* name) const;

 private:
  GlFunctions const& gl_;
  GLuint name_ = 0;
};

/// Throws Error{io} naming `what` where OpenGL reports an error or is out of memory.
void check_gl(GlFunctions const& gl, char const* what);

}  // namespace scanview
