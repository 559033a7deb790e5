#pragma once
#include <memory>

namespace scanview {

/// An OpenGL 3.3 core context and the way to its functions. At most one context is current on a thread; release one
/// before another is made current (GLX, EGL and OSMesa share the slot).
class GlContext {
 public:
  virtual ~GlContext() = default;
  virtual void make_current() = 0;
  virtual void release() = 0;
  using Function = void (*)();
  /// nullptr where there is none (OSMesa answers for names that do not exist: check the version first).
  virtual Function get_proc(char const* name) const = 0;
};

/// Off-screen, no display needed: OSMesa loaded with dlopen, else surfaceless EGL likewise (or only the one asked for).
/// Throws Error{io} where neither is installed, saying which package to install.
enum class OffscreenKind { any, osmesa, egl };
std::unique_ptr<GlContext> make_offscreen_context(OffscreenKind kind = OffscreenKind::any);

}  // namespace scanview
