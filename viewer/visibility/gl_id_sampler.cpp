#include "viewer/visibility/gl_id_sampler.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "base/error.h"
#include "viewer/view_based/view_transform.h"

namespace scanview {
namespace {

// The rasteriser's transform, u w, v w (pixels, centres at integers), w and depth, becomes OpenGL's clip coordinates:
// the picture's first row is OpenGL's row 0, so that pixels lie in memory as they should. Depths are linear in 1/z
// (perspective) or z.
constexpr char kVertexShader[] = R"(#version 330 core
layout(location = 0) in vec3 p_object;
uniform mat4 screen_from_object;
uniform vec2 size;
uniform vec2 depth;                // clip z = depth.x times the camera's depth + depth.y

void main() {
  vec4 screen = screen_from_object * vec4(p_object, 1.0);
  gl_Position = vec4((2.0 * screen.xy + screen.z) / size - screen.z, depth.x * screen.w + depth.y, screen.z);
}
)";

constexpr char kFragmentShader[] = R"(#version 330 core
layout(location = 0) out uint id;
void main() { id = uint(gl_PrimitiveID); }
)";

Eigen::Matrix4f screen_matrix(ScreenTransform const& transform) {
  Eigen::Matrix4f matrix;
  constexpr int kRows[] = {ScreenTransform::u, ScreenTransform::v, ScreenTransform::w, ScreenTransform::depth};
  for (int r = 0; r < 4; ++r) {
    for (int c = 0; c < 4; ++c) matrix(r, c) = static_cast<float>(transform.rows[kRows[r]][c]);
  }
  return matrix;
}

}  // namespace

/// What is deleted while the context is current.
struct GlIdSampler::Objects {
  explicit Objects(GlFunctions const& gl)
      : program(gl, kVertexShader, kFragmentShader), vertices(gl), indices(gl), array(gl), framebuffer(gl) {}
  GlProgram program;
  GlBuffer vertices, indices;
  GlVertexArray array;
  GlFramebuffer framebuffer;
  GlTexture ids, depths;
};

GlIdSampler::GlIdSampler(GlContext& context, TriangleMesh const& drawn)
    : context_(context), indices_(static_cast<GLsizei>(3 * drawn.triangles.size())) {
  for (auto const& vertex : drawn.vertices) bounds_.extend(vertex.cast<double>());
  context_.make_current();
  gl_ = load_gl_functions(context_);
  objects_ = std::make_unique<Objects>(gl_);
  gl_.BindVertexArray(objects_->array.name());
  gl_.BindBuffer(GL_ARRAY_BUFFER, objects_->vertices.name());
  gl_.BufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(drawn.vertices.size() * sizeof(Eigen::Vector3f)),
                 drawn.vertices.data(), GL_STATIC_DRAW);
  gl_.EnableVertexAttribArray(0);
  gl_.VertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, sizeof(Eigen::Vector3f), nullptr);
  gl_.BindBuffer(GL_ELEMENT_ARRAY_BUFFER, objects_->indices.name());
  gl_.BufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(drawn.triangles.size() * sizeof(Eigen::Vector3i)),
                 drawn.triangles.data(), GL_STATIC_DRAW);
  gl_.BindVertexArray(0);
  check_gl(gl_, "the mesh whose triangles are sampled");
}

GlIdSampler::~GlIdSampler() {
  // Where the context cannot be bound any more its objects are gone with it.
  try {
    context_.make_current();
  } catch (Error const&) {
  }
  objects_.reset();
}

void GlIdSampler::resize(int width, int height) {
  if (picture_.id.size() == cv::Size(width, height)) return;
  if (std::max(width, height) > gl_.max_texture_size) {
    throw Error(ErrorCode::bad_input, {},
                fmt::format("a picture of {} x {} is more than OpenGL can draw here ({} pixels)", width, height,
                            gl_.max_texture_size));
  }
  auto const texture = [&](GlTexture& of, GLint format, GLenum channels, GLenum type, GLenum attachment) {
    of = GlTexture(gl_);
    gl_.BindTexture(GL_TEXTURE_2D, of.name());
    gl_.TexImage2D(GL_TEXTURE_2D, 0, format, width, height, 0, channels, type, nullptr);
    gl_.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    gl_.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    gl_.FramebufferTexture2D(GL_FRAMEBUFFER, attachment, GL_TEXTURE_2D, of.name(), 0);
  };
  gl_.BindFramebuffer(GL_FRAMEBUFFER, objects_->framebuffer.name());
  texture(objects_->ids, GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, GL_COLOR_ATTACHMENT0);
  texture(objects_->depths, GL_DEPTH_COMPONENT32F, GL_DEPTH_COMPONENT, GL_FLOAT, GL_DEPTH_ATTACHMENT);
  check_gl(gl_, "the picture of triangles");
  picture_.id.create(height, width);
  picture_.depth.create(height, width);
}

IdBuffer const& GlIdSampler::draw(SampleCamera const& sample) {
  Camera const& camera = sample.camera;
  Eigen::Isometry3d const camera_from_object = sample.object_from_camera.inverse();
  context_.make_current();
  resize(camera.width(), camera.height());
  constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();
  DepthRange range;
  if (indices_ == 0 || !depth_range(bounds_, camera_from_object, camera.is_perspective(), range)) {
    picture_.id = kNoTriangle;
    picture_.depth = kNothing;
    return picture_;
  }
  gl_.BindFramebuffer(GL_FRAMEBUFFER, objects_->framebuffer.name());
  GLenum const buffers[] = {GL_COLOR_ATTACHMENT0};
  gl_.DrawBuffers(1, buffers);
  if (gl_.CheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
    throw Error(ErrorCode::io, {}, "OpenGL cannot draw identifiers of 32 bits here");
  gl_.Viewport(0, 0, camera.width(), camera.height());
  gl_.Enable(GL_DEPTH_TEST);
  gl_.DepthFunc(GL_LESS);
  gl_.Disable(GL_CULL_FACE);
  gl_.Disable(GL_BLEND);
  // Where depths stay those of nothing, identifiers mean nothing and need not be cleared.
  float const far_away[] = {1, 0, 0, 0};
  gl_.ClearBufferfv(GL_DEPTH, 0, far_away);

  Eigen::Matrix4f const matrix = screen_matrix(screen_transform(camera, camera_from_object, range));
  double const length = range.far - range.near;
  bool const perspective = camera.is_perspective();
  GlProgram const& program = objects_->program;
  program.use();
  gl_.UniformMatrix4fv(program.uniform("screen_from_object"), 1, GL_FALSE, matrix.data());
  gl_.Uniform2f(program.uniform("size"), static_cast<float>(camera.width()), static_cast<float>(camera.height()));
  gl_.Uniform2f(program.uniform("depth"), static_cast<float>((perspective ? range.far + range.near : 2) / length),
                static_cast<float>(-(perspective ? 2 * range.far * range.near : range.far + range.near) / length));
  gl_.BindVertexArray(objects_->array.name());
  gl_.DrawElements(GL_TRIANGLES, indices_, GL_UNSIGNED_INT, nullptr);
  gl_.BindVertexArray(0);

  gl_.PixelStorei(GL_PACK_ALIGNMENT, 4);
  gl_.ReadBuffer(GL_COLOR_ATTACHMENT0);
  gl_.ReadPixels(0, 0, camera.width(), camera.height(), GL_RED_INTEGER, GL_UNSIGNED_INT, picture_.id.data);
  gl_.ReadPixels(0, 0, camera.width(), camera.height(), GL_DEPTH_COMPONENT, GL_FLOAT, picture_.depth.data);
  check_gl(gl_, "drawing which triangles are seen");
  auto const near = static_cast<float>(range.near), far = static_cast<float>(range.far);
  auto const inverse_near = static_cast<float>(1 / range.near),
             inverse_length = static_cast<float>(1 / range.near - 1 / range.far);
  for (int y = 0; y < picture_.id.rows; ++y) {
    int* const id = picture_.id[y];
    float* const depth = picture_.depth[y];
    for (int x = 0; x < picture_.id.cols; ++x) {
      if (depth[x] >= 1) {
        id[x] = kNoTriangle;
        depth[x] = kNothing;
      } else {
        depth[x] = perspective ? 1 / (inverse_near - depth[x] * inverse_length) : near + depth[x] * (far - near);
      }
    }
  }
  return picture_;
}

}  // namespace scanview
