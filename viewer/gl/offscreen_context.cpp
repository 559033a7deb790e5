#include <cstdint>
#include <string>
#include <vector>

#include "base/error.h"
#include "viewer/gl/current_context.h"
#include "viewer/gl/gl_context.h"
#include "viewer/gl/shared_library.h"

namespace scanview {
namespace {

// Both libraries are opened at run time and declared here: linking them beside libGL makes calls silently do nothing,
// and their headers would pull in packages that are needed for nothing else.

/// Mesa's software rasteriser into memory. We draw into framebuffer objects only; the buffer that OSMesa asks for is
/// never used.
class OsMesaContext final : public GlContext {
 public:
  explicit OsMesaContext(char const* library) : library_(library) {
    if (!library_.loaded()) throw Error(ErrorCode::io, {}, std::string(library) + " is not installed");
    make_current_ = library_.get<MakeCurrent>("OSMesaMakeCurrent");
    destroy_ = library_.get<Destroy>("OSMesaDestroyContext");
    get_proc_ = library_.get<GetProc>("OSMesaGetProcAddress");
    constexpr int kFormat = 0x22, kRgba = 0x1908, kDepthBits = 0x30, kProfile = 0x33, kCoreProfile = 0x34,
                  kMajor = 0x36, kMinor = 0x37;
    int const attributes[] = {kFormat, kRgba, kDepthBits, 0, kProfile, kCoreProfile, kMajor, 3, kMinor, 3, 0, 0};
    context_ = library_.get<Create>("OSMesaCreateContextAttribs")(attributes, nullptr);
    if (context_ == nullptr) throw Error(ErrorCode::io, {}, std::string(library) + " gives no OpenGL 3.3 core context");
  }
  ~OsMesaContext() override {
    release();
    destroy_(context_);
  }

  void make_current() override {
    if (!begin_make_current(this)) return;
    constexpr unsigned kUnsignedByte = 0x1401;
    if (make_current_(context_, buffer_, kUnsignedByte, kSize, kSize) == 0) {
      throw Error(ErrorCode::io, {}, "OSMesa: the context cannot be made current");
    }
    set_current_context(this);
  }
  void release() override {
    if (current_context() != this) return;
    make_current_(nullptr, nullptr, 0, 0, 0);
    set_current_context(nullptr);
  }
  Function get_proc(char const* name) const override { return get_proc_(name); }

 private:
  using Create = void* (*)(int const*, void*);
  using Destroy = void (*)(void*);
  using MakeCurrent = unsigned char (*)(void*, void*, unsigned, int, int);
  using GetProc = Function (*)(char const*);
  static constexpr int kSize = 16;

  SharedLibrary library_;
  MakeCurrent make_current_ = nullptr;
  Destroy destroy_ = nullptr;
  GetProc get_proc_ = nullptr;
  void* context_ = nullptr;
  std::uint8_t buffer_[kSize * kSize * 4] = {};
};

/// EGL without any surface: what replaces OSMesa from Mesa 25.1 on, and what uses a graphics card without a display.
class SurfacelessContext final : public GlContext {
 public:
  explicit SurfacelessContext(char const* library) : library_(library) {
    if (!library_.loaded()) throw Error(ErrorCode::io, {}, std::string(library) + " is not installed");
    make_current_ = library_.get<MakeCurrent>("eglMakeCurrent");
    destroy_ = library_.get<Destroy>("eglDestroyContext");
    get_proc_ = library_.get<GetProc>("eglGetProcAddress");
    bind_api_ = library_.get<BindApi>("eglBindAPI");
    constexpr unsigned kPlatformSurfaceless = 0x31DD;
    auto const get_display = reinterpret_cast<GetPlatformDisplay>(get_proc_("eglGetPlatformDisplayEXT"));
    if (get_display == nullptr) throw Error(ErrorCode::io, {}, "EGL: no platform displays");
    display_ = get_display(kPlatformSurfaceless, nullptr, nullptr);
    int major = 0, minor = 0;
    if (display_ == nullptr || library_.get<Initialize>("eglInitialize")(display_, &major, &minor) == 0) {
      throw Error(ErrorCode::io, {}, "EGL: no surfaceless display");
    }
    constexpr int kNone = 0x3038, kRenderableType = 0x3040, kOpenGlBit = 0x0008, kSurfaceType = 0x3033;
    int const config_attributes[] = {kRenderableType, kOpenGlBit, kSurfaceType, 0, kNone};
    void* config = nullptr;
    int count = 0;
    bind();
    if (library_.get<ChooseConfig>("eglChooseConfig")(display_, config_attributes, &config, 1, &count) == 0 ||
        count < 1) {
      throw Error(ErrorCode::io, {}, "EGL: no configuration for OpenGL without a surface");
    }
    constexpr int kMajor = 0x3098, kMinor = 0x30FB, kProfileMask = 0x30FD, kCoreBit = 1;
    int const attributes[] = {kMajor, 3, kMinor, 3, kProfileMask, kCoreBit, kNone};
    context_ = library_.get<Create>("eglCreateContext")(display_, config, nullptr, attributes);
    if (context_ == nullptr) throw Error(ErrorCode::io, {}, "EGL gives no OpenGL 3.3 core context");
  }
  // The display stays initialised: EGL gives one display to all contexts of a process, and ours may not be the last.
  ~SurfacelessContext() override {
    release();
    destroy_(display_, context_);
  }

  void make_current() override {
    if (!begin_make_current(this)) return;
    bind();
    if (make_current_(display_, nullptr, nullptr, context_) == 0) {
      throw Error(ErrorCode::io, {}, "EGL: the context cannot be made current");
    }
    set_current_context(this);
  }
  void release() override {
    if (current_context() != this) return;
    bind();
    make_current_(display_, nullptr, nullptr, nullptr);
    set_current_context(nullptr);
  }
  Function get_proc(char const* name) const override { return get_proc_(name); }

 private:
  using Create = void* (*)(void*, void*, void*, int const*);
  using Destroy = unsigned (*)(void*, void*);
  using MakeCurrent = unsigned (*)(void*, void*, void*, void*);
  using GetProc = Function (*)(char const*);
  using BindApi = unsigned (*)(unsigned);
  using GetPlatformDisplay = void* (*)(unsigned, void*, int const*);
  using Initialize = unsigned (*)(void*, int*, int*);
  using ChooseConfig = unsigned (*)(void*, int const*, void**, int, int*);

  // EGL remembers the API a thread last asked for.
  void bind() const {
    constexpr unsigned kOpenGlApi = 0x30A2;
    if (bind_api_(kOpenGlApi) == 0) throw Error(ErrorCode::io, {}, "EGL: no desktop OpenGL");
  }

  SharedLibrary library_;
  MakeCurrent make_current_ = nullptr;
  Destroy destroy_ = nullptr;
  GetProc get_proc_ = nullptr;
  BindApi bind_api_ = nullptr;
  void* display_ = nullptr;
  void* context_ = nullptr;
};

}  // namespace

std::unique_ptr<GlContext> make_offscreen_context(OffscreenKind kind) {
  std::string why;
  if (kind != OffscreenKind::egl) {
    try {
      return std::make_unique<OsMesaContext>("libOSMesa.so.8");
    } catch (Error const& error) {
      why = error.message();
    }
  }
  if (kind != OffscreenKind::osmesa) {
    try {
      return std::make_unique<SurfacelessContext>("libEGL.so.1");
    } catch (Error const& error) {
      why += (why.empty() ? "" : "; ") + error.message();
    }
  }
  throw Error(ErrorCode::io, {},
              "no OpenGL without a display (" + why +
                  "): install the package libosmesa6, or libegl1 with libegl-mesa0 and libgl1-mesa-dri");
}

}  // namespace scanview
