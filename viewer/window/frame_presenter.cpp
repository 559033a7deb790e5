#include "viewer/window/frame_presenter.h"

namespace scanview {
namespace {

constexpr char kVertexShader[] = R"(#version 330 core
out vec2 st;
void main() {
  vec2 corner = vec2((gl_VertexID << 1) & 2, gl_VertexID & 2);
  st = vec2(corner.x, 1.0 - corner.y);   // the frame's first row is its top
  gl_Position = vec4(2.0 * corner - 1.0, 0.0, 1.0);
}
)";

constexpr char kFragmentShader[] = R"(#version 330 core
in vec2 st;
uniform sampler2D frame;
out vec4 color;
void main() {
  vec4 over = texture(frame, st);
  vec3 background = mix(vec3(0.22, 0.24, 0.27), vec3(0.10, 0.11, 0.12), st.y);
  color = vec4(mix(background, over.rgb, over.a), 1.0);
}
)";

}  // namespace

FramePresenter::FramePresenter(GlFunctions const& gl)
    : gl_(gl), program_(gl, kVertexShader, kFragmentShader), no_vertices_(gl), texture_(gl) {
  gl_.BindTexture(GL_TEXTURE_2D, texture_.name());
  gl_.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  gl_.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  gl_.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  gl_.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
}

void FramePresenter::present(Frame const& frame, int width, int height) {
  gl_.ActiveTexture(GL_TEXTURE0);
  gl_.BindTexture(GL_TEXTURE_2D, texture_.name());
  gl_.PixelStorei(GL_UNPACK_ALIGNMENT, 1);
  gl_.TexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, frame.color.cols, frame.color.rows, 0, GL_BGRA, GL_UNSIGNED_BYTE,
                 frame.color.data);
  gl_.BindFramebuffer(GL_FRAMEBUFFER, 0);
  gl_.Viewport(0, 0, width, height);
  gl_.Disable(GL_DEPTH_TEST);
  gl_.Disable(GL_CULL_FACE);
  program_.use();
  gl_.Uniform1i(program_.uniform("frame"), 0);
  gl_.BindVertexArray(no_vertices_.name());
  gl_.DrawArrays(GL_TRIANGLES, 0, 3);
}

}  // namespace scanview
