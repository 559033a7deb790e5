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

// SoftZ for one pixel; then what layer `current` adds to it.
constexpr char kAddShader[] = R"(
uniform sampler2DArray samples;
uniform sampler2DArray light;
uniform int layer_count;
uniform float layer_weight[MAX_LAYERS];
uniform float layer_fill[MAX_LAYERS];
uniform float layer_fill_rank[MAX_LAYERS];
uniform vec3 layer_hue[MAX_LAYERS];
uniform int current;
uniform sampler2D picture;
uniform vec2 size;
uniform vec3 gain;
uniform mat3 along, at;
uniform int show;                  // SoftZ::Show
uniform bool nearest;
uniform float threshold;
uniform float ramp;                // 1 / (half a threshold)
uniform float reliability_ratio;
uniform float always;
layout(location = 0) out vec4 sum;
layout(location = 1) out float sum_depth;

float hide(float distance) { return clamp((distance - threshold) * ramp, 0.0, 1.0); }

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  float quality[MAX_LAYERS], fair_fill[MAX_LAYERS], rank[MAX_LAYERS], z[MAX_LAYERS], reliable[MAX_LAYERS],
      seen[MAX_LAYERS], share[MAX_LAYERS];
  int layer[MAX_LAYERS];
  int count = 0, mine = -1;
  float lod = 0.0;
  for (int i = 0; i < layer_count; ++i) {
    vec4 of_view = texelFetch(samples, ivec3(pixel, i), 0);
    float r = (layer_weight[i] + layer_fill_rank[i] * of_view.z) * of_view.y;
    if (r > 0.0) {
      if (i == current) {
        mine = count;
        lod = of_view.w;
      }
      z[count] = of_view.x;
      quality[count] = of_view.y;
      fair_fill[count] = layer_fill[i] * of_view.z;
      rank[count] = r;
      layer[count++] = i;
    }
  }
  if (mine < 0) discard;
  if (nearest) {
    for (int k = 0; k < count; ++k) {
      share[k] = 1.0;
      for (int i = 0; i < count; ++i) {
        if (z[i] < z[k] || (z[i] == z[k] && i < k)) share[k] = 0.0;
      }
    }
  } else {
    for (int i = 0; i < count; ++i) {
      float doubt = 0.0;
      for (int j = 0; j < count; ++j) {
        float low = clamp(2.0 - 2.0 * rank[i] / (reliability_ratio * rank[j] + 1e-30), 0.0, 1.0);
        doubt = max(doubt, hide(z[j] - z[i]) * low);
      }
      reliable[i] = 1.0 - doubt;
    }
    float good = 0.0;
    for (int k = 0; k < count; ++k) {
      float hidden = 0.0;
      for (int i = 0; i < count; ++i) hidden = max(hidden, reliable[i] * hide(z[k] - z[i]));
      seen[k] = reliable[k] * (1.0 - hidden);
      good += layer_weight[layer[k]] * min(1.0, GOOD_AT_ZERO + quality[k] / GOOD_QUALITY) * seen[k];
    }
    float need = clamp(1.0 - good / GOOD_ENOUGH, always, 1.0);
    for (int k = 0; k < count; ++k) {
      share[k] = (layer_weight[layer[k]] + need * fair_fill[k]) * quality[k] * seen[k];
    }
  }
  if (show == 2) {
    int winner = 0;
    for (int k = 1; k < count; ++k) {
      if (share[k] > share[winner]) winner = k;
    }
    if (winner != mine) discard;
  }
  if (!(share[mine] > 0.0)) discard;
  float total = 0.0, depth = 0.0;
  for (int k = 0; k < count; ++k) {
    total += share[k];
    depth += share[k] * z[k];
  }
  depth = depth / total;
  vec3 color = layer_hue[current];
  if (show == 0 && lod >= 0.0) {
    vec3 place = vec3(vec2(pixel), 1.0);
    vec3 texel = depth * (along * place) + at * place;
    color = gain * texelFetch(light, ivec3(pixel, current), 0).rgb *
            textureLod(picture, texel.xy / (texel.z * size), lod).rgb;
  }
  sum = share[mine] * vec4(color, 1.0);
  sum_depth = share[mine] * z[mine];
}
)";

// Colour goes out as B, G, R, A: the order of the picture in memory.
constexpr char kResolveShader[] = R"(#version 330 core
uniform sampler2D sums;
uniform sampler2D sums_depth;
layout(location = 0) out vec4 out_color;
layout(location = 1) out float out_depth;

float srgb(float x) {
  x = clamp(x, 0.0, 1.0);
  return x <= 0.0031308 ? 12.92 * x : 1.055 * pow(x, 1.0 / 2.4) - 0.055;
}

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 sum = texelFetch(sums, pixel, 0);
  if (sum.a > 0.0) {
    vec3 color = sum.rgb / sum.a;
    out_color = vec4(srgb(color.b), srgb(color.g), srgb(color.r), 1.0);
    out_depth = texelFetch(sums_depth, pixel, 0).r / sum.a;
  } else {
    out_color = vec4(0.0);
    out_depth = 0.0;
  }
}
)";

std::string add_shader() {
  return fmt::format(
             "#version 330 core\nconst int MAX_LAYERS = {};\nconst float GOOD_AT_ZERO = {};\n"
             "const float GOOD_QUALITY = {};\nconst float GOOD_ENOUGH = {};\n",
             SoftZ::kMaxLayers, SoftZ::kGoodAtZero, SoftZ::kGoodQuality, SoftZ::kGoodEnough) +
         kAddShader;
}

}  // namespace

SoftZCompositor::SoftZCompositor(GlFunctions const& gl)
    : gl_(gl),
      add_(gl, kVertexShader, add_shader()),
      resolve_(gl, kVertexShader, kResolveShader),
      no_vertices_(gl),
      sums_framebuffer_(gl),
      framebuffer_(gl) {}

void SoftZCompositor::resize(int width, int height) {
  if (width == width_ && height == height_) return;
  width_ = height_ = 0;
  auto const target = [&](GlTexture& texture, GLint format, GLenum components, GLenum type, GLenum attachment) {
    texture = GlTexture(gl_);
    gl_.BindTexture(GL_TEXTURE_2D, texture.name());
    gl_.TexImage2D(GL_TEXTURE_2D, 0, format, width, height, 0, components, type, nullptr);
    gl_.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    gl_.FramebufferTexture2D(GL_FRAMEBUFFER, attachment, GL_TEXTURE_2D, texture.name(), 0);
  };
  auto const finish = [&] {
    GLenum const buffers[] = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
    gl_.DrawBuffers(2, buffers);
    if (gl_.CheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
      throw Error(ErrorCode::io, {}, "OpenGL cannot draw into float textures here");
    }
  };
  gl_.BindFramebuffer(GL_FRAMEBUFFER, sums_framebuffer_.name());
  target(sums_, GL_RGBA32F, GL_RGBA, GL_FLOAT, GL_COLOR_ATTACHMENT0);
  target(sums_depth_, GL_R32F, GL_RED, GL_FLOAT, GL_COLOR_ATTACHMENT1);
  finish();
  gl_.BindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
  target(color_, GL_RGBA8, GL_RGBA, GL_UNSIGNED_BYTE, GL_COLOR_ATTACHMENT0);
  target(depth_, GL_R32F, GL_RED, GL_FLOAT, GL_COLOR_ATTACHMENT1);
  finish();
  check_gl(gl_, "the composed picture");
  width_ = width;
  height_ = height;
}

void SoftZCompositor::set_weights(std::vector<LayerWeight> const& weights, SoftZ const& soft_z) {
  std::vector<float> weight, fill, rank;
  std::vector<Eigen::Vector3f> hue;
  for (auto const& layer : weights) {
    weight.push_back(static_cast<float>(layer.weight));
    fill.push_back(static_cast<float>(layer.fill));
    rank.push_back(static_cast<float>(layer.fill_rank));
    hue.push_back(layer.hue);
  }
  auto const count = static_cast<GLsizei>(weights.size());
  gl_.Uniform1i(add_.uniform("layer_count"), count);
  if (count > 0) {
    gl_.Uniform1fv(add_.uniform("layer_weight"), count, weight.data());
    gl_.Uniform1fv(add_.uniform("layer_fill"), count, fill.data());
    gl_.Uniform1fv(add_.uniform("layer_fill_rank"), count, rank.data());
    gl_.Uniform3fv(add_.uniform("layer_hue"), count, hue.front().data());
  }
  gl_.Uniform1f(add_.uniform("always"), static_cast<float>(soft_z.always));
  gl_.Uniform1i(add_.uniform("show"), static_cast<GLint>(soft_z.show));
  gl_.Uniform1i(add_.uniform("nearest"), soft_z.nearest ? 1 : 0);
  // Infinite and zero thresholds stay finite in the shader's arithmetic and mean the same.
  constexpr double kLargest = 1e30;
  double const threshold = std::min(soft_z.threshold, kLargest);
  gl_.Uniform1f(add_.uniform("threshold"), static_cast<float>(threshold));
  gl_.Uniform1f(add_.uniform("ramp"), static_cast<float>(threshold > 0 ? std::min(2 / threshold, kLargest) : kLargest));
  gl_.Uniform1f(add_.uniform("reliability_ratio"), static_cast<float>(soft_z.reliability_ratio));
}

Frame SoftZCompositor::compose(LayerTargets const& layers, std::vector<LayerWeight> const& weights,
                               std::vector<LayerPicture> const& pictures, SoftZ const& soft_z) {
  if (weights.size() > static_cast<std::size_t>(SoftZ::kMaxLayers) || weights.size() != pictures.size()) {
    throw std::logic_error("SoftZCompositor: too many layers, or not one picture a layer");
  }
  resize(layers.width(), layers.height());
  gl_.Viewport(0, 0, width_, height_);
  gl_.Disable(GL_DEPTH_TEST);
  gl_.Disable(GL_CULL_FACE);
  gl_.BindVertexArray(no_vertices_.name());

  gl_.BindFramebuffer(GL_FRAMEBUFFER, sums_framebuffer_.name());
  float const nothing[] = {0, 0, 0, 0};
  gl_.ClearBufferfv(GL_COLOR, 0, nothing);
  gl_.ClearBufferfv(GL_COLOR, 1, nothing);
  gl_.Enable(GL_BLEND);
  gl_.BlendFunc(GL_ONE, GL_ONE);
  add_.use();
  gl_.ActiveTexture(GL_TEXTURE0);
  gl_.BindTexture(GL_TEXTURE_2D_ARRAY, layers.samples());
  gl_.Uniform1i(add_.uniform("samples"), 0);
  gl_.Uniform1i(add_.uniform("picture"), 1);
  gl_.ActiveTexture(GL_TEXTURE2);
  gl_.BindTexture(GL_TEXTURE_2D_ARRAY, layers.light());
  gl_.Uniform1i(add_.uniform("light"), 2);
  set_weights(weights, soft_z);
  gl_.ActiveTexture(GL_TEXTURE1);
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    LayerPicture const& picture = pictures[i];
    gl_.BindTexture(GL_TEXTURE_2D, picture.texture);
    gl_.Uniform1i(add_.uniform("current"), static_cast<GLint>(i));
    gl_.Uniform2f(add_.uniform("size"), picture.size.x(), picture.size.y());
    gl_.Uniform3f(add_.uniform("gain"), picture.gain.x(), picture.gain.y(), picture.gain.z());
    gl_.UniformMatrix3fv(add_.uniform("along"), 1, GL_FALSE, picture.place.along.data());
    gl_.UniformMatrix3fv(add_.uniform("at"), 1, GL_FALSE, picture.place.at.data());
    gl_.DrawArrays(GL_TRIANGLES, 0, 3);
  }
  gl_.Disable(GL_BLEND);

  gl_.BindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
  resolve_.use();
  gl_.ActiveTexture(GL_TEXTURE0);
  gl_.BindTexture(GL_TEXTURE_2D, sums_.name());
  gl_.ActiveTexture(GL_TEXTURE1);
  gl_.BindTexture(GL_TEXTURE_2D, sums_depth_.name());
  gl_.Uniform1i(resolve_.uniform("sums"), 0);
  gl_.Uniform1i(resolve_.uniform("sums_depth"), 1);
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
