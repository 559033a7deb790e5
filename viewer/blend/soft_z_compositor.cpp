#include "viewer/blend/soft_z_compositor.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "acquire/range_image.h"
#include "base/error.h"

namespace scanview {
namespace {

// One triangle over the whole picture.
constexpr char kVertexShader[] = R"(#version 330 core
void main() {
  vec2 corner = vec2((gl_VertexID << 1) & 2, gl_VertexID & 2);
  gl_Position = vec4(2.0 * corner - 1.0, 0.0, 1.0);
}
)";

// Colour goes out as B, G, R, A: the order of the picture in memory.
constexpr char kFragmentShader[] = R"(
uniform sampler2DArray color_layers;
uniform sampler2DArray depth_layers;
uniform int layer_count;
uniform float layer_weight[MAX_LAYERS];
uniform float layer_fill[MAX_LAYERS];
uniform vec3 layer_hue[MAX_LAYERS];
uniform int show;                  // SoftZ::Show
uniform bool nearest;
uniform float threshold;
uniform float ramp;               // 1 / (half a threshold)
uniform float reliability_ratio;
layout(location = 0) out vec4 out_color;
layout(location = 1) out float out_depth;

float hide(float distance) { return clamp((distance - threshold) * ramp, 0.0, 1.0); }

float srgb(float x) {
  x = clamp(x, 0.0, 1.0);
  return x <= 0.0031308 ? 12.92 * x : 1.055 * pow(x, 1.0 / 2.4) - 0.055;
}

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  float w[MAX_LAYERS];
  float z[MAX_LAYERS];
  int layer[MAX_LAYERS];
  float quality[MAX_LAYERS];
  int count = 0;
  float good = 0.0;
  for (int i = 0; i < layer_count; ++i) {
    float q = texelFetch(depth_layers, ivec3(pixel, i), 0).g;
    if (q > 0.0) {
      quality[count] = q;
      layer[count++] = i;
      good += layer_weight[i] * min(1.0, GOOD_AT_ZERO + q / GOOD_QUALITY);
    }
  }
  float need = clamp(1.0 - good / GOOD_ENOUGH, 0.0, 1.0);
  int kept = 0;
  for (int k = 0; k < count; ++k) {
    int i = layer[k];
    // What only fills must be fairly good itself: the last fringe of a mesh, seen grazingly, hangs from the true outline.
    float fair = clamp(quality[k] / FAIR_QUALITY - 1.0, 0.0, 1.0);
    float weight = (layer_weight[i] + need * fair * layer_fill[i]) * quality[k];
    if (weight > 0.0) {
      w[kept] = weight;
      z[kept] = texelFetch(depth_layers, ivec3(pixel, i), 0).r;
      layer[kept++] = i;
    }
  }
  count = kept;
  float reliable[MAX_LAYERS];
  for (int i = 0; i < count; ++i) {
    float doubt = 0.0;
    for (int j = 0; j < count; ++j) {
      float low = clamp(2.0 - 2.0 * w[i] / (reliability_ratio * w[j] + 1e-30), 0.0, 1.0);
      doubt = max(doubt, hide(z[j] - z[i]) * low);
    }
    reliable[i] = 1.0 - doubt;
  }
  vec4 sum = vec4(0.0);
  float depth = 0.0;
  float greatest = 0.0;
  for (int k = 0; k < count; ++k) {
    float hidden = 0.0;
    for (int i = 0; i < count; ++i) hidden = max(hidden, reliable[i] * hide(z[k] - z[i]));
    float weight = w[k] * reliable[k] * (1.0 - hidden);
    if (nearest) {
      weight = 1.0;
      for (int i = 0; i < count; ++i) {
        if (z[i] < z[k] || (z[i] == z[k] && i < k)) weight = 0.0;
      }
    }
    vec3 color = texelFetch(color_layers, ivec3(pixel, layer[k]), 0).rgb;
    if (show != 0) color = layer_hue[layer[k]];
    if (show == 2) {
      if (weight <= greatest) continue;
      greatest = weight;
      sum = vec4(0.0);
      depth = 0.0;
    }
    sum += weight * vec4(color, 1.0);
    depth += weight * z[k];
  }
  if (sum.a > 0.0) {
    vec3 color = sum.rgb / sum.a;
    out_color = vec4(srgb(color.b), srgb(color.g), srgb(color.r), 1.0);
    out_depth = depth / sum.a;
  } else {
    out_color = vec4(0.0);
    out_depth = 0.0;
  }
}
)";

std::string fragment_shader() {
  return fmt::format(
             "#version 330 core\nconst int MAX_LAYERS = {};\nconst float GOOD_AT_ZERO = {};\n"
             "const float GOOD_QUALITY = {};\nconst float GOOD_ENOUGH = {};\nconst float FAIR_QUALITY = {};\n",
             SoftZ::kMaxLayers, SoftZ::kGoodAtZero, SoftZ::kGoodQuality, SoftZ::kGoodEnough, SoftZ::kFairQuality) +
         kFragmentShader;
}

}  // namespace

SoftZCompositor::SoftZCompositor(GlFunctions const& gl)
    : gl_(gl), program_(gl, kVertexShader, fragment_shader()), no_vertices_(gl), framebuffer_(gl) {}

void SoftZCompositor::resize(int width, int height) {
  if (width == width_ && height == height_) return;
  width_ = height_ = 0;
  color_ = GlTexture(gl_);
  gl_.BindTexture(GL_TEXTURE_2D, color_.name());
  gl_.TexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, width, height, 0, GL_RGBA, GL_UNSIGNED_BYTE, nullptr);
  gl_.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  depth_ = GlTexture(gl_);
  gl_.BindTexture(GL_TEXTURE_2D, depth_.name());
  gl_.TexImage2D(GL_TEXTURE_2D, 0, GL_R32F, width, height, 0, GL_RED, GL_FLOAT, nullptr);
  gl_.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  gl_.BindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
  gl_.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, color_.name(), 0);
  gl_.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT1, GL_TEXTURE_2D, depth_.name(), 0);
  GLenum const buffers[] = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
  gl_.DrawBuffers(2, buffers);
  if (gl_.CheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
    throw Error(ErrorCode::io, {}, "OpenGL cannot draw into float textures here");
  }
  check_gl(gl_, "the composed picture");
  width_ = width;
  height_ = height;
}

Frame SoftZCompositor::compose(LayerTargets const& layers, std::vector<LayerWeight> const& weights,
                               SoftZ const& soft_z) {
  constexpr int kMaxLayers = SoftZ::kMaxLayers;
  if (weights.size() > static_cast<std::size_t>(kMaxLayers)) {
    throw std::logic_error("SoftZCompositor: too many layers");
  }
  resize(layers.width(), layers.height());
  gl_.BindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
  gl_.Viewport(0, 0, width_, height_);
  gl_.Disable(GL_DEPTH_TEST);
  gl_.Disable(GL_CULL_FACE);
  program_.use();
  gl_.ActiveTexture(GL_TEXTURE0);
  gl_.BindTexture(GL_TEXTURE_2D_ARRAY, layers.color());
  gl_.ActiveTexture(GL_TEXTURE1);
  gl_.BindTexture(GL_TEXTURE_2D_ARRAY, layers.depth());
  gl_.Uniform1i(program_.uniform("color_layers"), 0);
  gl_.Uniform1i(program_.uniform("depth_layers"), 1);
  gl_.Uniform1i(program_.uniform("layer_count"), static_cast<GLint>(weights.size()));
  std::vector<float> weight(kMaxLayers, 0.0F), fill(kMaxLayers, 0.0F);
  std::vector<Eigen::Vector3f> hue(kMaxLayers, Eigen::Vector3f::Zero());
  for (std::size_t i = 0; i < weights.size(); ++i) {
    weight[i] = static_cast<float>(weights[i].weight);
    fill[i] = static_cast<float>(weights[i].fill);
    hue[i] = weights[i].hue;
  }
  gl_.Uniform1fv(program_.uniform("layer_weight"), kMaxLayers, weight.data());
  gl_.Uniform1fv(program_.uniform("layer_fill"), kMaxLayers, fill.data());
  gl_.Uniform3fv(program_.uniform("layer_hue"), kMaxLayers, hue.front().data());
  gl_.Uniform1i(program_.uniform("show"), static_cast<GLint>(soft_z.show));
  gl_.Uniform1i(program_.uniform("nearest"), soft_z.nearest ? 1 : 0);
  // Infinite and zero thresholds stay finite in the shader's arithmetic and mean the same.
  constexpr double kLargest = 1e30, kSteepest = 1e30;
  double const threshold = std::min(soft_z.threshold, kLargest);
  gl_.Uniform1f(program_.uniform("threshold"), static_cast<float>(threshold));
  gl_.Uniform1f(program_.uniform("ramp"),
                static_cast<float>(threshold > 0 ? std::min(2 / threshold, kSteepest) : kSteepest));
  gl_.Uniform1f(program_.uniform("reliability_ratio"), static_cast<float>(soft_z.reliability_ratio));
  gl_.BindVertexArray(no_vertices_.name());
  gl_.DrawArrays(GL_TRIANGLES, 0, 3);

  Frame frame;
  frame.color.create(height_, width_);
  frame.depth.create(height_, width_);
  gl_.PixelStorei(GL_PACK_ALIGNMENT, 1);
  gl_.ReadBuffer(GL_COLOR_ATTACHMENT0);
  gl_.ReadPixels(0, 0, width_, height_, GL_RGBA, GL_UNSIGNED_BYTE, frame.color.data);
  gl_.ReadBuffer(GL_COLOR_ATTACHMENT1);
  gl_.ReadPixels(0, 0, width_, height_, GL_RED, GL_FLOAT, frame.depth.data);
  check_gl(gl_, "composing the views");
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      if (frame.color(y, x)[3] == 0) frame.depth(y, x) = kMissing;
    }
  }
  return frame;
}

}  // namespace scanview
