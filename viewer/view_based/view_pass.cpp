#include "viewer/view_based/view_pass.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "base/error.h"
#include "viewer/view_based/vertex_light.h"
#include "viewer/view_based/view_transform.h"

namespace scanview {
namespace {

using Eigen::Matrix4d;
using Eigen::Vector3d;
using Eigen::Vector4d;

constexpr char kVertexShader[] = R"(#version 330 core
layout(location = 0) in vec3 p_source;
layout(location = 1) in vec3 normal;       // VertexLight
layout(location = 2) in vec3 logarithm;
uniform mat4 clip_from_source;
uniform mat4 camera_from_source;
uniform vec3 source;               // the view's camera, in this camera's coordinates
uniform bool source_far;           // infinitely far in that direction
uniform bool perspective;
uniform float angle_scale;
uniform bool lit;
uniform vec3 light[8];             // CameraLight::coefficients
uniform mat4 sample_from_source;   // rows: s w, t w, w (texture coordinates), depth in the rendering camera
out vec4 texture_and_depth;
out float nearness;
out vec3 relight;

void main() {
  gl_Position = clip_from_source * vec4(p_source, 1.0);
  texture_and_depth = sample_from_source * vec4(p_source, 1.0);
  vec3 p = (camera_from_source * vec4(p_source, 1.0)).xyz;
  vec3 to_view = source_far ? source : source - p;
  vec3 to_eye = perspective ? -p : vec3(0.0, 0.0, -1.0);
  float cosine = dot(to_view, to_eye) / max(length(to_view) * length(to_eye), 1e-30);
  nearness = 1.0 / (1.0 + angle_scale * max(0.0, 2.0 - 2.0 * cosine));
  relight = vec3(1.0);
  if (lit) {
    vec3 n = mat3(camera_from_source) * normal;
    n = normalize(vec3(n.xy, min(n.z, -0.1)));
    vec3 sum = -logarithm + light[0] * n.x + light[1] * n.y + light[2] * n.z + light[3] * n.x * n.y +
               light[4] * n.y * n.z + light[5] * n.x * n.z + light[6] * (n.x * n.x - n.y * n.y) +
               light[7] * (3.0 * n.z * n.z - 1.0);
    relight = exp(clamp(sum, -0.6931, 0.6931));
  }
}
)";

constexpr char kFragmentShader[] = R"(#version 330 core
in vec4 texture_and_depth;
in float nearness;
in vec3 relight;
uniform sampler2D feather;
uniform samplerBuffer cos_phi;
uniform vec2 size;                 // of the picture
uniform float least_weight, fair_feather;
uniform float use_cosine, use_feather;
uniform float largest_lod;
uniform bool line;                 // of a wireframe
layout(location = 0) out vec4 sample_of_view;   // depth, quality, fairness, level of detail (-1: a line)
layout(location = 1) out vec4 light_of_view;

// Spelled out, because drivers filter 8-bit textures with few bits.
float feather_at(vec2 st) {
  vec2 place = clamp(st * size - 0.5, vec2(0.0), size - 1.0);
  vec2 share = fract(place);
  ivec2 here = ivec2(place), next = min(here + 1, ivec2(size) - 1);
  vec2 upper = vec2(texelFetch(feather, here, 0).r, texelFetch(feather, ivec2(next.x, here.y), 0).r);
  vec2 lower = vec2(texelFetch(feather, ivec2(here.x, next.y), 0).r, texelFetch(feather, next, 0).r);
  vec2 column = mix(upper, lower, share.y);
  return mix(column.x, column.y, share.x);
}

void main() {
  vec2 st = texture_and_depth.xy / texture_and_depth.z;
  // Spelled out, because OpenGL leaves the choice of the mipmap to the driver.
  vec2 along_x = dFdx(st) * size, along_y = dFdy(st) * size;
  float lod = 0.5 * log2(max(abs(along_x.x * along_y.y - along_y.x * along_x.y), 1.0));
  float edge = feather_at(st);
  // In 16 bits, as the rasteriser keeps it.
  float near_cosine = floor(nearness * texelFetch(cos_phi, gl_PrimitiveID).r * 65535.0 + 0.5) / 65535.0;
  float quality = mix(1.0, near_cosine, use_cosine) * mix(1.0, edge, use_feather);
  sample_of_view = vec4(texture_and_depth.w, clamp(quality, least_weight, 1.0),
                        clamp(edge * edge / fair_feather - 1.0, 0.0, 1.0), line ? -1.0 : min(lod, largest_lod));
  light_of_view = vec4(relight, 1.0);
}
)";

/// OpenGL's clip coordinates of a point in camera coordinates. The picture's top row is OpenGL's row 0, so that pixels
/// lie in memory as they should; that mirrors the winding.
Matrix4d clip_from_camera(Camera const& camera, DepthRange const& range) {
  Eigen::Matrix<double, 3, 4> const picture = picture_from_camera(camera);
  Matrix4d clip = Matrix4d::Zero();
  clip.row(0) = 2 * picture.row(0) / camera.width() - picture.row(2);
  clip.row(1) = 2 * picture.row(1) / camera.height() - picture.row(2);
  clip.row(3) = picture.row(2);
  double const length = range.far - range.near;
  if (camera.is_perspective()) {
    clip.row(2) << 0, 0, (range.far + range.near) / length, -2 * range.far * range.near / length;
  } else {
    clip.row(2) << 0, 0, 2 / length, -(range.far + range.near) / length;
  }
  return clip;
}

void upload_buffer(GlFunctions const& gl, GLenum target, GlBuffer const& buffer, std::size_t bytes, void const* data) {
  gl.BindBuffer(target, buffer.name());
  gl.BufferData(target, static_cast<GLsizeiptr>(bytes), data, GL_STATIC_DRAW);
}

void clamp_to_edge(GlFunctions const& gl) {
  gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
}

void check_limits(GlFunctions const& gl, View const& view, ViewMesh const& view_mesh, PicturePyramid const& pyramid) {
  auto const refuse = [&](std::string const& why) {
    throw Error(ErrorCode::bad_input, {}, "view " + view.name + ": " + why);
  };
  if (view_mesh.mesh.triangles.size() > static_cast<std::size_t>(gl.max_texture_buffer_size)) {
    refuse(fmt::format("{} triangles are more than OpenGL can hold here ({})", view_mesh.mesh.triangles.size(),
                       gl.max_texture_buffer_size));
  }
  if (std::max(pyramid.area.width, pyramid.area.height) > gl.max_texture_size) {
    refuse(fmt::format("a picture of {} x {} is more than OpenGL can hold here ({})", pyramid.area.width,
                       pyramid.area.height, gl.max_texture_size));
  }
}

}  // namespace

GpuView::GpuView(GlFunctions const& gl, View const& view, ViewMesh const& view_mesh, PicturePyramid const& pyramid,
                 std::optional<CameraLight> const& light)
    : camera_(view_mesh.camera),
      object_from_camera_(*view.object_from_camera),
      area_(pyramid.area),
      levels_(static_cast<int>(pyramid.levels.size())),
      gain_(view.gain.cast<float>()),
      light_(light),
      index_count_(static_cast<GLsizei>(3 * view_mesh.mesh.triangles.size())) {
  check_limits(gl, view, view_mesh, pyramid);
  for (auto const& vertex : view_mesh.mesh.vertices) bounds_.extend(vertex.cast<double>());

  vertex_array_ = GlVertexArray(gl);
  gl.BindVertexArray(vertex_array_.name());
  vertices_ = GlBuffer(gl);
  upload_buffer(gl, GL_ARRAY_BUFFER, vertices_, view_mesh.mesh.vertices.size() * sizeof(Eigen::Vector3f),
                view_mesh.mesh.vertices.data());
  gl.EnableVertexAttribArray(0);
  gl.VertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, sizeof(Eigen::Vector3f), nullptr);
  if (light_) {
    VertexLight const of_vertices = vertex_light(view_mesh.mesh, *light_);
    auto const attribute = [&](GLuint location, GlBuffer& buffer, std::vector<Eigen::Vector3f> const& values) {
      buffer = GlBuffer(gl);
      upload_buffer(gl, GL_ARRAY_BUFFER, buffer, values.size() * sizeof(Eigen::Vector3f), values.data());
      gl.EnableVertexAttribArray(location);
      gl.VertexAttribPointer(location, 3, GL_FLOAT, GL_FALSE, sizeof(Eigen::Vector3f), nullptr);
    };
    attribute(1, normals_, of_vertices.normals);
    attribute(2, logarithms_, of_vertices.logarithms);
  }
  indices_ = GlBuffer(gl);
  upload_buffer(gl, GL_ELEMENT_ARRAY_BUFFER, indices_, view_mesh.mesh.triangles.size() * sizeof(Eigen::Vector3i),
                view_mesh.mesh.triangles.data());
  gl.BindVertexArray(0);

  cos_phi_ = GlBuffer(gl);
  std::vector<std::uint16_t> const cosines = cosine_labels(view_mesh);
  upload_buffer(gl, GL_TEXTURE_BUFFER, cos_phi_, cosines.size() * sizeof(std::uint16_t), cosines.data());
  cos_phi_texture_ = GlTexture(gl);
  gl.BindTexture(GL_TEXTURE_BUFFER, cos_phi_texture_.name());
  gl.TexBuffer(GL_TEXTURE_BUFFER, GL_R16, cos_phi_.name());

  gl.PixelStorei(GL_UNPACK_ALIGNMENT, 1);
  picture_ = GlTexture(gl);
  gl.BindTexture(GL_TEXTURE_2D, picture_.name());
  for (std::size_t level = 0; level < pyramid.levels.size(); ++level) {
    cv::Mat3b const& picture = pyramid.levels[level];
    gl.TexImage2D(GL_TEXTURE_2D, static_cast<GLint>(level), GL_SRGB8_ALPHA8, picture.cols, picture.rows, 0, GL_BGR,
                  GL_UNSIGNED_BYTE, picture.data);
  }
  gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
  gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  clamp_to_edge(gl);

  feather_ = GlTexture(gl);
  gl.BindTexture(GL_TEXTURE_2D, feather_.name());
  gl.TexImage2D(GL_TEXTURE_2D, 0, GL_R8, pyramid.feather.cols, pyramid.feather.rows, 0, GL_RED, GL_UNSIGNED_BYTE,
                pyramid.feather.data);
  gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  clamp_to_edge(gl);
  check_gl(gl, ("the mesh and picture of view " + view.name).c_str());
}

void GpuView::place(Camera const& camera, Eigen::Isometry3d const& object_from_camera, LayerPicture& picture) const {
  picture.texture = picture_.name();
  picture.size = Eigen::Vector2f(static_cast<float>(area_.width), static_cast<float>(area_.height));
  picture.gain = gain_;
  picture.place = picture_place(camera_, area_, object_from_camera_.inverse() * object_from_camera, camera);
}

ViewPass::ViewPass(GlFunctions const& gl) : gl_(gl), program_(gl, kVertexShader, kFragmentShader) {}

bool ViewPass::in_front(GpuView const& view, Camera const& camera, Eigen::Isometry3d const& object_from_camera) {
  DepthRange range;
  return depth_range(view.bounds_, object_from_camera.inverse() * view.object_from_camera_, camera.is_perspective(),
                     range);
}

bool ViewPass::draw(GpuView const& view, Camera const& camera, Eigen::Isometry3d const& object_from_camera,
                    Look const& look) const {
  // In double precision: the two poses may be far from the origin, their difference is not.
  Eigen::Isometry3d const camera_from_source = object_from_camera.inverse() * view.object_from_camera_;
  DepthRange range;
  if (!depth_range(view.bounds_, camera_from_source, camera.is_perspective(), range)) return false;
  Eigen::Matrix4f const clip_from_source =
      (clip_from_camera(camera, range) * camera_from_source.matrix()).cast<float>();
  Matrix4d sample_from_source;
  Eigen::Matrix<double, 3, 4> texture = picture_from_camera(view.camera_, view.area_.x, view.area_.y);
  texture.row(0) /= view.area_.width;
  texture.row(1) /= view.area_.height;
  sample_from_source << texture, camera_from_source.matrix().row(2);
  Eigen::Matrix4f const samples = sample_from_source.cast<float>();

  gl_.Enable(GL_DEPTH_TEST);
  gl_.DepthFunc(GL_LESS);
  gl_.Enable(GL_CULL_FACE);
  gl_.CullFace(GL_BACK);
  // Triangles are counter-clockwise seen from the source camera with y up; here y runs down (see clip_from_camera).
  gl_.FrontFace(GL_CW);
  program_.use();
  gl_.UniformMatrix4fv(program_.uniform("clip_from_source"), 1, GL_FALSE, clip_from_source.data());
  gl_.UniformMatrix4fv(program_.uniform("sample_from_source"), 1, GL_FALSE, samples.data());
  Eigen::Matrix4f const camera_from = camera_from_source.matrix().cast<float>();
  gl_.UniformMatrix4fv(program_.uniform("camera_from_source"), 1, GL_FALSE, camera_from.data());
  bool const far = !view.camera_.is_perspective();
  Eigen::Vector3f const source =
      (far ? Vector3d(-camera_from_source.linear().col(2)) : Vector3d(camera_from_source.translation())).cast<float>();
  gl_.Uniform3f(program_.uniform("source"), source.x(), source.y(), source.z());
  gl_.Uniform1i(program_.uniform("source_far"), far ? 1 : 0);
  gl_.Uniform1i(program_.uniform("perspective"), camera.is_perspective() ? 1 : 0);
  double const width = SoftZ::kNearSpacings * look.spacing;
  gl_.Uniform1f(program_.uniform("angle_scale"), static_cast<float>(1 / (width * width)));
  bool const lit = look.relight && view.light_;
  gl_.Uniform1i(program_.uniform("lit"), lit ? 1 : 0);
  if (lit) {
    Eigen::Matrix<float, 3, CameraLight::kTerms> const light = view.light_->coefficients.transpose().cast<float>();
    gl_.Uniform3fv(program_.uniform("light"), CameraLight::kTerms, light.data());
  }
  gl_.Uniform1f(program_.uniform("least_weight"), static_cast<float>(SoftZ::kLeastQuality));
  gl_.Uniform1f(program_.uniform("fair_feather"), static_cast<float>(SoftZ::kFairFeather));
  gl_.Uniform2f(program_.uniform("size"), static_cast<float>(view.area_.width), static_cast<float>(view.area_.height));
  gl_.Uniform1f(program_.uniform("use_cosine"), look.cosine ? 1 : 0);
  gl_.Uniform1f(program_.uniform("use_feather"), look.feather ? 1 : 0);
  gl_.Uniform1f(program_.uniform("largest_lod"), static_cast<float>(view.levels_ - 1));
  gl_.Uniform1i(program_.uniform("line"), 0);
  gl_.ActiveTexture(GL_TEXTURE0);
  gl_.BindTexture(GL_TEXTURE_2D, view.feather_.name());
  gl_.ActiveTexture(GL_TEXTURE1);
  gl_.BindTexture(GL_TEXTURE_BUFFER, view.cos_phi_texture_.name());
  gl_.Uniform1i(program_.uniform("feather"), 0);
  gl_.Uniform1i(program_.uniform("cos_phi"), 1);
  gl_.BindVertexArray(view.vertex_array_.name());
  gl_.DrawElements(GL_TRIANGLES, view.index_count_, GL_UNSIGNED_INT, nullptr);
  if (look.wireframe) {
    gl_.Uniform1i(program_.uniform("line"), 1);
    gl_.PolygonMode(GL_FRONT_AND_BACK, GL_LINE);
    gl_.DepthFunc(GL_LEQUAL);
    gl_.DrawElements(GL_TRIANGLES, view.index_count_, GL_UNSIGNED_INT, nullptr);
    gl_.PolygonMode(GL_FRONT_AND_BACK, GL_FILL);
  }
  return true;
}

}  // namespace scanview
