#include <algorithm>
#include <cmath>
#include <cstring>

#include "viewer/raster/kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "viewer/raster/draw_kernels.cpp"
#include <hwy/foreach_target.h>  // compiles this file once for each instruction set
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace scanview {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Triangles are small: eight pixels at a time, also where the processor could do sixteen.
using Floats = hn::CappedTag<float, 8>;
using Ints = hn::RebindToSigned<Floats>;
using Words = hn::RebindToUnsigned<Floats>;

/// exp(x) for |x| <= ln 2: a Padé approximation, within 2e-6.
template <class V>
HWY_INLINE V SmallExp(V x) {
  Floats const d;
  auto const even = hn::Add(hn::Set(d, 1.0F), hn::Mul(hn::Mul(x, x), hn::Set(d, 0.1F)));
  auto const odd = hn::Mul(x, hn::Add(hn::Set(d, 0.5F), hn::Mul(hn::Mul(x, x), hn::Set(d, 1.0F / 120))));
  return hn::Div(hn::Add(even, odd), hn::Sub(even, odd));
}

/// How close the view's camera comes to seeing a point from the side this camera does. 2 − 2 cos θ is θ² for small
/// angles.
template <class V>
HWY_INLINE V Nearness(ScreenTransform const& transform, V x, V y, V z) {
  Floats const d;
  auto const one = hn::Set(d, 1.0F);
  auto const length = [&](V a, V b, V c)
                          HWY_ATTR { return hn::Sqrt(hn::Add(hn::Add(hn::Mul(a, a), hn::Mul(b, b)), hn::Mul(c, c))); };
  auto const sx = hn::Set(d, transform.source[0]), sy = hn::Set(d, transform.source[1]),
             sz = hn::Set(d, transform.source[2]);
  auto const vx = transform.source_far ? sx : hn::Sub(sx, x), vy = transform.source_far ? sy : hn::Sub(sy, y),
             vz = transform.source_far ? sz : hn::Sub(sz, z);
  auto const ex = transform.perspective ? hn::Neg(x) : hn::Zero(d),
             ey = transform.perspective ? hn::Neg(y) : hn::Zero(d),
             ez = transform.perspective ? hn::Neg(z) : hn::Set(d, -1.0F);
  auto const to_view = length(vx, vy, vz), to_eye = length(ex, ey, ez);
  auto const product = hn::Max(hn::Mul(to_view, to_eye), hn::Set(d, 1e-30F));
  auto const cosine = hn::Div(hn::Add(hn::Add(hn::Mul(vx, ex), hn::Mul(vy, ey)), hn::Mul(vz, ez)), product);
  auto const squared_angle = hn::Max(hn::Zero(d), hn::Sub(hn::Set(d, 2.0F), hn::Add(cosine, cosine)));
  return hn::Div(one, hn::Add(one, hn::Mul(squared_angle, hn::Set(d, transform.angle_scale))));
}

/// The light at vertices (VertexLight) as this camera would see it, as a share of what the view's camera saw.
void Relight(VertexArrays const& vertices, ScreenTransform const& transform, std::size_t i, float (*out)[8]) {
  Floats const d;
  auto const component = [&](int r) HWY_ATTR {
    auto const* const m = transform.camera_from_source[r];
    return hn::Add(hn::Add(hn::Mul(hn::Set(d, m[0]), hn::LoadU(d, &vertices.normal[0][i])),
                           hn::Mul(hn::Set(d, m[1]), hn::LoadU(d, &vertices.normal[1][i]))),
                   hn::Mul(hn::Set(d, m[2]), hn::LoadU(d, &vertices.normal[2][i])));
  };
  auto x = component(0), y = component(1);
  // A surface that is seen turns towards the camera; a smoothed normal may not.
  auto z = hn::Min(component(2), hn::Set(d, -0.1F));
  auto const length = hn::Sqrt(hn::Add(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), hn::Mul(z, z)));
  auto const scale = hn::Div(hn::Set(d, 1.0F), length);
  x = hn::Mul(x, scale);
  y = hn::Mul(y, scale);
  z = hn::Mul(z, scale);
  auto const zz = hn::Mul(z, z);
  decltype(x) const terms[8] = {x,
                                y,
                                z,
                                hn::Mul(x, y),
                                hn::Mul(y, z),
                                hn::Mul(x, z),
                                hn::Sub(hn::Mul(x, x), hn::Mul(y, y)),
                                hn::Sub(hn::Add(zz, hn::Add(zz, zz)), hn::Set(d, 1.0F))};
  for (int c = 0; c < 3; ++c) {
    auto sum = hn::Neg(hn::LoadU(d, &vertices.light[c][i]));
    for (int k = 0; k < 8; ++k) sum = hn::Add(sum, hn::Mul(hn::Set(d, transform.light[k][c]), terms[k]));
    constexpr float kMost = 0.6931F;  // ln 2
    sum = hn::Min(hn::Max(sum, hn::Set(d, -kMost)), hn::Set(d, kMost));
    hn::Store(SmallExp(sum), d, out[c]);
  }
}

/// Where vertices lie on the screen; u and v in 1/256 pixel.
struct PlacedLanes {
  hn::Vec<Floats> u, v, w, inverse, key;
};

/// A row of a transform, at eight points.
HWY_INLINE hn::Vec<Floats> Row(ScreenTransform const& transform, int r, hn::Vec<Floats> x, hn::Vec<Floats> y,
                               hn::Vec<Floats> z) {
  Floats const d;
  double const* const m = transform.rows[r];
  auto const coefficient = [&](int c) HWY_ATTR { return hn::Set(d, static_cast<float>(m[c])); };
  auto const xy = hn::Add(hn::Mul(coefficient(0), x), hn::Mul(coefficient(1), y));
  return hn::Add(hn::Add(xy, hn::Mul(coefficient(2), z)), coefficient(3));
}

HWY_INLINE PlacedLanes Place(ScreenTransform const& transform, hn::Vec<Floats> x, hn::Vec<Floats> y,
                             hn::Vec<Floats> z) {
  Floats const d;
  auto const one = hn::Set(d, 1.0F), subpixels = hn::Set(d, 256.0F);
  PlacedLanes placed;
  placed.w = Row(transform, ScreenTransform::w, x, y, z);
  placed.inverse = transform.perspective ? hn::Div(one, placed.w) : one;
  placed.u = hn::Mul(hn::Mul(Row(transform, ScreenTransform::u, x, y, z), placed.inverse), subpixels);
  placed.v = hn::Mul(hn::Mul(Row(transform, ScreenTransform::v, x, y, z), placed.inverse), subpixels);
  placed.key = transform.perspective ? placed.inverse : hn::Neg(Row(transform, ScreenTransform::depth, x, y, z));
  return placed;
}

/// Which of them are in front of the camera and no more than `margin` pixels outside the picture.
HWY_INLINE hn::Mask<Floats> Inside(ScreenTransform const& transform, PlacedLanes const& placed, int width, int height,
                                   int margin) {
  Floats const d;
  auto const low = hn::Set(d, -256.0F * static_cast<float>(margin));
  auto const right = hn::Set(d, 256.0F * static_cast<float>(width + margin));
  auto const bottom = hn::Set(d, 256.0F * static_cast<float>(height + margin));
  auto inside = hn::And(hn::And(hn::Ge(placed.u, low), hn::Le(placed.u, right)),
                        hn::And(hn::Ge(placed.v, low), hn::Le(placed.v, bottom)));
  if (!transform.perspective) return inside;
  return hn::And(inside, hn::Gt(placed.w, hn::Set(d, static_cast<float>(transform.near))));
}

void TransformVertices(VertexArrays const& vertices, ScreenTransform const& transform, std::size_t begin,
                       std::size_t end, int width, int height, ScreenVertex* out) {
  Floats const d;
  Ints const di;
  std::size_t const lanes = hn::Lanes(d);
  auto const one = hn::Set(d, 1.0F);
  HWY_ALIGN float value[ScreenVertex::kValues][8];
  HWY_ALIGN std::int32_t x[8], y[8];
  for (std::size_t i = begin; i < end; i += lanes) {
    auto const px = hn::LoadU(d, &vertices.x[i]), py = hn::LoadU(d, &vertices.y[i]), pz = hn::LoadU(d, &vertices.z[i]);
    auto const row = [&](int r) HWY_ATTR { return Row(transform, r, px, py, pz); };
    auto const placed = Place(transform, px, py, pz);
    auto const inside = Inside(transform, placed, width, height, kGuardBand);
    auto const inverse = placed.inverse;
    auto const fixed_u = hn::NearestInt(hn::IfThenElseZero(inside, placed.u));
    hn::Store(hn::IfThenElse(hn::RebindMask(di, inside), fixed_u, hn::Set(di, kBeyond)), di, x);
    hn::Store(hn::NearestInt(hn::IfThenElseZero(inside, placed.v)), di, y);
    hn::Store(placed.key, d, value[ScreenVertex::key]);
    hn::Store(hn::Mul(row(ScreenTransform::s), inverse), d, value[ScreenVertex::s]);
    hn::Store(hn::Mul(row(ScreenTransform::t), inverse), d, value[ScreenVertex::t]);
    hn::Store(hn::Mul(row(ScreenTransform::texture_w), inverse), d, value[ScreenVertex::w]);
    auto nearness = Nearness(transform, row(ScreenTransform::x_camera), row(ScreenTransform::y_camera),
                             row(ScreenTransform::depth));
    if (!vertices.quality.empty()) nearness = hn::Mul(nearness, hn::LoadU(d, &vertices.quality[i]));
    hn::Store(nearness, d, value[ScreenVertex::nearness]);
    if (transform.lit) {
      Relight(vertices, transform, i, &value[ScreenVertex::red]);
    } else {
      for (int c = 0; c < 3; ++c) hn::Store(one, d, value[ScreenVertex::red + c]);
    }
    for (int j = ScreenVertex::nearness; j < ScreenVertex::kValues; ++j) {
      hn::Store(hn::Mul(hn::Load(d, value[j]), inverse), d, value[j]);
    }
    std::size_t const count = std::min(lanes, end - i);
    for (std::size_t k = 0; k < count; ++k) {
      out[i + k].x = x[k];
      out[i + k].y = y[k];
      for (int j = 0; j < ScreenVertex::kValues; ++j) out[i + k].values[j] = value[j][k];
    }
  }
}

/// log2 of x >= 1, within 0.001.
template <class V>
HWY_INLINE V Log2(V x) {
  Floats const d;
  Ints const di;
  auto const bits = hn::BitCast(di, x);
  auto const exponent = hn::ConvertTo(d, hn::Sub(hn::ShiftRight<23>(bits), hn::Set(di, 127)));
  auto const mantissa = hn::BitCast(d, hn::Or(hn::And(bits, hn::Set(di, 0x7fffff)), hn::Set(di, 0x3f800000)));
  auto const r = hn::Sub(mantissa, hn::Set(d, 1.0F));
  // A cubic that is exact at both ends, so that levels join without a step.
  auto const p =
      hn::Add(hn::Mul(hn::Add(hn::Mul(hn::Set(d, 0.15922F), r), hn::Set(d, -0.58208F)), r), hn::Set(d, 1.42286F));
  return hn::Add(exponent, hn::Mul(r, p));
}

/// What is constant for one triangle: the slopes of a vertex's values on the screen.
struct Slopes {
  float x[ScreenVertex::kValues], y[ScreenVertex::kValues];
};

/// kLit: whether there is light to be interpolated too.
template <bool kLit>
class TextureWriter {
 public:
  static constexpr int kValues = kLit ? ScreenVertex::kValues : ScreenVertex::red;
  explicit TextureWriter(TextureTarget const& target) : target_(target) {}
  float* keys() const { return target_.key; }
  int stride() const { return kTileStride; }
  bool wants_edges() const { return target_.wireframe; }

  template <class M, class V>
  HWY_INLINE void Write(std::size_t at, M mask, V key, float const* base, V lane, Slopes const& slopes,
                        std::uint32_t label, M on_edge) const {
    Floats const d;
    Words const du;
    Ints const di;
    auto const plane = [&](int k)
                           HWY_ATTR { return hn::Add(hn::Set(d, base[k]), hn::Mul(hn::Set(d, slopes.x[k]), lane)); };
    auto const inverse = hn::Div(hn::Set(d, 1.0F), plane(ScreenVertex::w));
    auto const s = hn::Mul(plane(ScreenVertex::s), inverse), t = hn::Mul(plane(ScreenVertex::t), inverse);
    // What was divided by the depth for the way over the screen.
    auto const depth = target_.perspective ? hn::Div(hn::Set(d, 1.0F), key) : hn::Set(d, 1.0F);
    auto const cosine = hn::Mul(hn::Mul(plane(ScreenVertex::nearness), depth), hn::Set(d, static_cast<float>(label)));
    auto packed = hn::ShiftLeft<16>(hn::BitCast(
        du, hn::ConvertTo(di, hn::Min(hn::Max(hn::Add(cosine, hn::Set(d, 0.5F)), hn::Zero(d)), hn::Set(d, 65535.0F)))));
    if (target_.largest_lod > 0) {
      auto const slope = [&](float of_value, float of_w, V value)
                             HWY_ATTR { return hn::Sub(hn::Set(d, of_value), hn::Mul(value, hn::Set(d, of_w))); };
      auto const sx = slope(slopes.x[ScreenVertex::s], slopes.x[ScreenVertex::w], s),
                 tx = slope(slopes.x[ScreenVertex::t], slopes.x[ScreenVertex::w], t);
      auto const sy = slope(slopes.y[ScreenVertex::s], slopes.y[ScreenVertex::w], s),
                 ty = slope(slopes.y[ScreenVertex::t], slopes.y[ScreenVertex::w], t);
      // The area of the pixel in texels: the longer side would blur whatever is seen at an angle, and views are
      // averaged anyway.
      auto const rho = hn::Mul(hn::Abs(hn::Sub(hn::Mul(sx, ty), hn::Mul(sy, tx))), hn::Mul(inverse, inverse));
      auto const minified = hn::Gt(rho, hn::Set(d, 1.0F));
      if (!hn::AllFalse(d, minified)) {
        auto lod = hn::Mul(hn::Set(d, 0.5F), Log2(hn::Min(hn::Max(rho, hn::Set(d, 1.0F)), hn::Set(d, 1e30F))));
        lod = hn::Min(lod, hn::Set(d, target_.largest_lod));
        packed = hn::Or(packed, hn::BitCast(du, hn::ConvertTo(di, hn::Mul(lod, hn::Set(d, 2048.0F)))));
      }
    }
    packed = hn::Or(packed, hn::IfThenElseZero(hn::RebindMask(du, on_edge), hn::Set(du, 1U << 15)));
    auto const store = [&](float* to, V value)
                           HWY_ATTR { hn::StoreU(hn::IfThenElse(mask, value, hn::LoadU(d, to + at)), d, to + at); };
    store(target_.key, key);
    store(target_.s, s);
    store(target_.t, t);
    if constexpr (kLit) {
      auto const bits = [&](int k) HWY_ATTR {
        auto const share = hn::Min(hn::Max(hn::Mul(plane(k), depth), hn::Zero(d)), hn::Set(d, 2.0F));
        return hn::BitCast(du, hn::ConvertTo(di, hn::Add(hn::Mul(share, hn::Set(d, 511.5F)), hn::Set(d, 0.5F))));
      };
      auto const light = hn::Or(hn::Or(bits(ScreenVertex::red), hn::ShiftLeft<10>(bits(ScreenVertex::green))),
                                hn::ShiftLeft<20>(bits(ScreenVertex::blue)));
      hn::StoreU(hn::IfThenElse(hn::RebindMask(du, mask), light, hn::LoadU(du, target_.light + at)), du,
                 target_.light + at);
    }
    hn::StoreU(hn::IfThenElse(hn::RebindMask(du, mask), packed, hn::LoadU(du, target_.packed + at)), du,
               target_.packed + at);
  }

 private:
  TextureTarget target_;
};

class IdWriter {
 public:
  static constexpr int kValues = 1;  // the key
  explicit IdWriter(IdTarget const& target) : target_(target) {}
  float* keys() const { return target_.key; }
  int stride() const { return target_.stride; }
  bool wants_edges() const { return false; }

  template <class M, class V>
  HWY_INLINE void Write(std::size_t at, M mask, V key, float const*, V, Slopes const&, std::uint32_t label, M) const {
    Floats const d;
    Words const du;
    hn::StoreU(hn::IfThenElse(mask, key, hn::LoadU(d, target_.key + at)), d, target_.key + at);
    hn::StoreU(hn::IfThenElse(hn::RebindMask(du, mask), hn::Set(du, label), hn::LoadU(du, target_.id + at)), du,
               target_.id + at);
  }

 private:
  IdTarget target_;
};

template <class Vertex, class Writer>
HWY_INLINE void DrawTriangle(Vertex const& a, Vertex const& b, Vertex const& c, std::uint32_t label,
                             TileArea const& area, Writer const& writer) {
  Floats const d;
  Ints const di;
  int const lanes = static_cast<int>(hn::Lanes(d));

  // Pixel centres inside the bounding box, inside the tile.
  int const left = std::max((std::min({a.x, b.x, c.x}) + 255) >> 8, area.left);
  int const right = std::min(std::max({a.x, b.x, c.x}) >> 8, area.right - 1);
  int const top = std::max((std::min({a.y, b.y, c.y}) + 255) >> 8, area.top);
  int const bottom = std::min(std::max({a.y, b.y, c.y}) >> 8, area.bottom - 1);
  if (left > right || top > bottom) return;

  // Edge functions E = A x + B y + C, at least 0 inside; in units of 256 subpixels at pixel centres, where the rest of
  // C is rounded down: that changes no sign. Top and left edges own their points.
  int step_x[3], step_y[3], start[3];
  Vertex const* const corners[] = {&a, &b, &c};
  for (int k = 0; k < 3; ++k) {
    Vertex const& from = *corners[k];
    Vertex const& to = *corners[k == 2 ? 0 : k + 1];
    int const ex = from.y - to.y, ey = to.x - from.x;
    bool const owns = ex > 0 || (ex == 0 && ey > 0);
    std::int64_t const constant = -(std::int64_t{ex} * from.x + std::int64_t{ey} * from.y) - (owns ? 0 : 1);
    std::int64_t const at_start = (constant >> 8) + std::int64_t{ex} * left + std::int64_t{ey} * top;
    // Beyond what the steps within a tile can make up for.
    constexpr std::int64_t kFar = 1 << 30;
    step_x[k] = ex;
    step_y[k] = ey;
    start[k] = static_cast<int>(std::clamp(at_start, -kFar, kFar));
  }

  // Slopes of what is linear on the screen, a pixel.
  float const dx1 = static_cast<float>(b.x - a.x), dy1 = static_cast<float>(b.y - a.y);
  float const dx2 = static_cast<float>(c.x - a.x), dy2 = static_cast<float>(c.y - a.y);
  std::int64_t const area2 = std::int64_t{b.x - a.x} * (c.y - a.y) - std::int64_t{b.y - a.y} * (c.x - a.x);
  float const scale = 256.0F / static_cast<float>(area2);
  float const a_x = static_cast<float>(a.x) / 256, a_y = static_cast<float>(a.y) / 256;
  Slopes slopes;
  float at_left[Writer::kValues];
  constexpr int values = Writer::kValues;
  for (int k = 0; k < values; ++k) {
    float const at_a = a.values[k], d1 = b.values[k] - at_a, d2 = c.values[k] - at_a;
    slopes.x[k] = (d1 * dy2 - d2 * dy1) * scale;
    slopes.y[k] = (d2 * dx1 - d1 * dx2) * scale;
    at_left[k] = at_a + slopes.x[k] * (static_cast<float>(left) - a_x);
  }

  // Slopes of needles are beyond single precision.
  auto const [least, most] = std::minmax({a.values[0], b.values[0], c.values[0]});
  auto const least_key = hn::Set(d, least), most_key = hn::Set(d, most);

  // For wireframes: the distance from an edge in pixels is E / length.
  float edge_scale[3] = {0, 0, 0};
  if (writer.wants_edges()) {
    for (int k = 0; k < 3; ++k) {
      float const ex = static_cast<float>(step_x[k]), ey = static_cast<float>(step_y[k]);
      edge_scale[k] = 1 / std::max(1.0F, std::sqrt(ex * ex + ey * ey));
    }
  }

  auto const iota = hn::Iota(di, 0);
  auto const step0 = hn::Mul(hn::Set(di, step_x[0]), iota), step1 = hn::Mul(hn::Set(di, step_x[1]), iota),
             step2 = hn::Mul(hn::Set(di, step_x[2]), iota);
  for (int y = top; y <= bottom; ++y) {
    int const down = y - top;
    auto e0 = hn::Add(hn::Set(di, start[0] + step_y[0] * down), step0);
    auto e1 = hn::Add(hn::Set(di, start[1] + step_y[1] * down), step1);
    auto e2 = hn::Add(hn::Set(di, start[2] + step_y[2] * down), step2);
    float base[Writer::kValues];
    for (int k = 0; k < values; ++k) base[k] = at_left[k] + slopes.y[k] * (static_cast<float>(y) - a_y);
    auto lane = hn::Iota(d, 0);  // pixels from `left`: exact, so that sums do not depend on the vector's width
    std::size_t at = static_cast<std::size_t>((y - area.top) * writer.stride() + (left - area.left));
    for (int x = left; x <= right; x += lanes) {
      auto const covered = hn::Gt(hn::Or(hn::Or(e0, e1), e2), hn::Set(di, -1));
      if (!hn::AllFalse(di, covered)) {
        auto const plane = hn::Add(hn::Set(d, base[0]), hn::Mul(hn::Set(d, slopes.x[0]), lane));
        auto const key = hn::Min(hn::Max(plane, least_key), most_key);
        auto const mask = hn::And(hn::RebindMask(d, covered), hn::Gt(key, hn::LoadU(d, writer.keys() + at)));
        if (!hn::AllFalse(d, mask)) {
          auto on_edge = hn::FirstN(d, 0);
          if (writer.wants_edges()) {
            auto const distance = [&](auto e, int k)
                                      HWY_ATTR { return hn::Mul(hn::ConvertTo(d, e), hn::Set(d, edge_scale[k])); };
            on_edge = hn::Lt(hn::Min(hn::Min(distance(e0, 0), distance(e1, 1)), distance(e2, 2)), hn::Set(d, 0.6F));
          }
          writer.Write(at, mask, key, base, lane, slopes, label, on_edge);
        }
      }
      e0 = hn::Add(e0, hn::Set(di, step_x[0] * lanes));
      e1 = hn::Add(e1, hn::Set(di, step_x[1] * lanes));
      e2 = hn::Add(e2, hn::Set(di, step_x[2] * lanes));
      lane = hn::Add(lane, hn::Set(d, static_cast<float>(lanes)));
      at += static_cast<std::size_t>(lanes);
    }
  }
}

template <class Writer>
HWY_INLINE void DrawTriangles(ScreenTriangle const* triangles, std::size_t count, TileArea const& area,
                              Writer const& writer) {
  for (std::size_t i = 0; i < count; ++i) {
    ScreenTriangle const& t = triangles[i];
    DrawTriangle(*t.corners[0], *t.corners[1], *t.corners[2], t.label, area, writer);
  }
}

void DrawTextured(ScreenTriangle const* triangles, std::size_t count, TileArea const& area,
                  TextureTarget const& target) {
  if (target.lit) {
    DrawTriangles(triangles, count, area, TextureWriter<true>(target));
  } else {
    DrawTriangles(triangles, count, area, TextureWriter<false>(target));
  }
}

void DrawIds(ScreenTriangle const* triangles, std::size_t count, TileArea const& area, IdTarget const& target) {
  DrawTriangles(triangles, count, area, IdWriter(target));
}

bool PlaceVertices(VertexArrays const& vertices, ScreenTransform const& transform, int width, int height,
                   PlacedVertex* out) {
  Floats const d;
  Ints const di;
  std::size_t const lanes = hn::Lanes(d);
  HWY_ALIGN float key[8];
  HWY_ALIGN std::int32_t x[8], y[8];
  for (std::size_t i = 0; i < vertices.count; i += lanes) {
    auto const placed =
        Place(transform, hn::LoadU(d, &vertices.x[i]), hn::LoadU(d, &vertices.y[i]), hn::LoadU(d, &vertices.z[i]));
    std::size_t const count = std::min(lanes, vertices.count - i);
    auto const inside = Inside(transform, placed, width, height, kIdMargin);
    if (!hn::AllTrue(d, hn::Or(inside, hn::Not(hn::FirstN(d, count))))) return false;
    hn::Store(hn::NearestInt(placed.u), di, x);
    hn::Store(hn::NearestInt(placed.v), di, y);
    hn::Store(placed.key, d, key);
    for (std::size_t k = 0; k < count; ++k) out[i + k] = {x[k], y[k], {key[k]}};
  }
  return true;
}

/// Whether a pixel was drawn. DrawTriangle of one no wider than a vector, whose edge functions fit 32 bits when counted
/// from its first pixel.
HWY_INLINE bool DrawSmallId(PlacedVertex const& a, PlacedVertex const& b, PlacedVertex const& c, std::uint32_t label,
                            std::int32_t area2, int left, int top, int bottom, IdTarget const& target) {
  Floats const d;
  Ints const di;
  Words const du;
  PlacedVertex const* const corners[] = {&a, &b, &c};
  std::int32_t step_x[3], step_y[3], start[3];
  for (int k = 0; k < 3; ++k) {
    PlacedVertex const& from = *corners[k];
    PlacedVertex const& to = *corners[k == 2 ? 0 : k + 1];
    std::int32_t const ex = from.y - to.y, ey = to.x - from.x;
    bool const owns = ex > 0 || (ex == 0 && ey > 0);
    step_x[k] = 256 * ex;
    step_y[k] = 256 * ey;
    start[k] = ex * (256 * left - from.x) + ey * (256 * top - from.y) - (owns ? 0 : 1);
  }
  float const at_a = a.values[0], d1 = b.values[0] - at_a, d2 = c.values[0] - at_a;
  float const dx1 = static_cast<float>(b.x - a.x), dy1 = static_cast<float>(b.y - a.y);
  float const dx2 = static_cast<float>(c.x - a.x), dy2 = static_cast<float>(c.y - a.y);
  float const scale = 256.0F / static_cast<float>(area2);
  float const slope_x = (d1 * dy2 - d2 * dy1) * scale, slope_y = (d2 * dx1 - d1 * dx2) * scale;
  float const at_left = at_a + slope_x * (static_cast<float>(left) - static_cast<float>(a.x) / 256);
  float const a_y = static_cast<float>(a.y) / 256;
  float const least = std::min(std::min(at_a, b.values[0]), c.values[0]);
  float const most = std::max(std::max(at_a, b.values[0]), c.values[0]);

  auto const iota = hn::Iota(di, 0);
  auto e0 = hn::Add(hn::Set(di, start[0]), hn::Mul(hn::Set(di, step_x[0]), iota));
  auto e1 = hn::Add(hn::Set(di, start[1]), hn::Mul(hn::Set(di, step_x[1]), iota));
  auto e2 = hn::Add(hn::Set(di, start[2]), hn::Mul(hn::Set(di, step_x[2]), iota));
  auto const along = hn::Mul(hn::Set(d, slope_x), hn::Iota(d, 0));
  std::size_t at =
      static_cast<std::size_t>(top) * static_cast<std::size_t>(target.stride) + static_cast<std::size_t>(left);
  bool drew = false;
  for (int y = top; y <= bottom; ++y) {
    auto const plane = hn::Add(hn::Set(d, at_left + slope_y * (static_cast<float>(y) - a_y)), along);
    auto const key = hn::Min(hn::Max(plane, hn::Set(d, least)), hn::Set(d, most));
    auto const covered = hn::Gt(hn::Or(hn::Or(e0, e1), e2), hn::Set(di, -1));
    auto const before = hn::LoadU(d, target.key + at);
    auto const mask = hn::And(hn::RebindMask(d, covered), hn::Gt(key, before));
    if (!hn::AllFalse(d, mask)) {
      drew = true;
      hn::StoreU(hn::IfThenElse(mask, key, before), d, target.key + at);
      hn::StoreU(hn::IfThenElse(hn::RebindMask(du, mask), hn::Set(du, label), hn::LoadU(du, target.id + at)), du,
                 target.id + at);
    }
    e0 = hn::Add(e0, hn::Set(di, step_y[0]));
    e1 = hn::Add(e1, hn::Set(di, step_y[1]));
    e2 = hn::Add(e2, hn::Set(di, step_y[2]));
    at += static_cast<std::size_t>(target.stride);
  }
  return drew;
}

/// Whether a pixel may have been drawn.
template <bool kListed>
HWY_INLINE bool DrawMesh(PlacedVertex const* vertices, std::int32_t const* corners, std::uint32_t const* list,
                         std::size_t count, float behind, TileArea const& area, IdTarget const& target) {
  Floats const d;
  int const lanes = static_cast<int>(hn::Lanes(d));
  IdWriter const writer(target);
  PlacedVertex moved[3];
  bool drew = false;
  for (std::size_t i = 0; i < count; ++i) {
    std::uint32_t const triangle = kListed ? list[i] : static_cast<std::uint32_t>(i);
    PlacedVertex const& a = vertices[corners[3 * std::size_t{triangle}]];
    PlacedVertex const* b = &vertices[corners[3 * std::size_t{triangle} + 1]];
    PlacedVertex const* c = &vertices[corners[3 * std::size_t{triangle} + 2]];
    // Half of a closed mesh turns its back, and of a fine one most triangles cover no pixel's centre.
    std::int64_t const area2 = std::int64_t{b->x - a.x} * (c->y - a.y) - std::int64_t{b->y - a.y} * (c->x - a.x);
    if (kListed ? area2 == 0 : area2 >= 0) continue;
    int const left = (std::min(std::min(a.x, b->x), c->x) + 255) >> 8, right = std::max(std::max(a.x, b->x), c->x) >> 8;
    int const top = (std::min(std::min(a.y, b->y), c->y) + 255) >> 8, bottom = std::max(std::max(a.y, b->y), c->y) >> 8;
    if (left > right || top > bottom) continue;
    if (area2 < 0) std::swap(b, c);
    if (kListed) {
      for (int k = 0; k < 3; ++k) moved[k] = *(k == 0 ? &a : k == 1 ? b : c);
      for (auto& vertex : moved) vertex.values[0] -= behind;
    }
    PlacedVertex const &first = kListed ? moved[0] : a, &second = kListed ? moved[1] : *b,
                       &third = kListed ? moved[2] : *c;
    if (right - left < lanes && bottom - top < 64 && left >= area.left && right < area.right && top >= area.top &&
        bottom < area.bottom) {
      drew |= DrawSmallId(first, second, third, triangle, static_cast<std::int32_t>(area2 < 0 ? -area2 : area2), left,
                          top, bottom, target);
    } else {
      DrawTriangle(first, second, third, triangle, area, writer);
      drew = true;
    }
  }
  return drew;
}

void DrawMeshFronts(PlacedVertex const* vertices, std::int32_t const* corners, std::size_t count, TileArea const& area,
                    IdTarget const& target) {
  DrawMesh<false>(vertices, corners, nullptr, count, 0, area, target);
}

bool DrawMeshIds(PlacedVertex const* vertices, std::int32_t const* corners, std::uint32_t const* list,
                 std::size_t count, float behind, TileArea const& area, IdTarget const& target) {
  return DrawMesh<true>(vertices, corners, list, count, behind, area, target);
}

}  // namespace HWY_NAMESPACE
}  // namespace scanview
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace scanview {

HWY_EXPORT(TransformVertices);
HWY_EXPORT(DrawTextured);
HWY_EXPORT(DrawIds);
HWY_EXPORT(PlaceVertices);
HWY_EXPORT(DrawMeshFronts);
HWY_EXPORT(DrawMeshIds);

void transform_vertices(VertexArrays const& vertices, ScreenTransform const& transform, std::size_t begin,
                        std::size_t end, int width, int height, ScreenVertex* out) {
  HWY_DYNAMIC_DISPATCH(TransformVertices)(vertices, transform, begin, end, width, height, out);
}

void draw_textured(ScreenTriangle const* triangles, std::size_t count, TileArea const& area,
                   TextureTarget const& target) {
  HWY_DYNAMIC_DISPATCH(DrawTextured)(triangles, count, area, target);
}

void draw_ids(ScreenTriangle const* triangles, std::size_t count, TileArea const& area, IdTarget const& target) {
  HWY_DYNAMIC_DISPATCH(DrawIds)(triangles, count, area, target);
}

bool place_vertices(VertexArrays const& vertices, ScreenTransform const& transform, int width, int height,
                    PlacedVertex* out) {
  return HWY_DYNAMIC_DISPATCH(PlaceVertices)(vertices, transform, width, height, out);
}

void draw_mesh_fronts(PlacedVertex const* vertices, std::int32_t const* corners, std::size_t count,
                      TileArea const& area, IdTarget const& target) {
  HWY_DYNAMIC_DISPATCH(DrawMeshFronts)(vertices, corners, count, area, target);
}

bool draw_mesh_ids(PlacedVertex const* vertices, std::int32_t const* corners, std::uint32_t const* list,
                   std::size_t count, float behind, TileArea const& area, IdTarget const& target) {
  return HWY_DYNAMIC_DISPATCH(DrawMeshIds)(vertices, corners, list, count, behind, area, target);
}

std::vector<char const*> kernel_targets() {
  std::vector<char const*> names;
  for (std::int64_t targets = hwy::SupportedTargets(); targets != 0; targets &= targets - 1) {
    names.push_back(hwy::TargetName(targets & -targets));
  }
  return names;
}

void use_kernel_target(char const* name) {
  hwy::SetSupportedTargetsForTest(0);
  std::int64_t chosen = 0;
  for (std::int64_t targets = hwy::SupportedTargets(); targets != 0; targets &= targets - 1) {
    if (std::strcmp(hwy::TargetName(targets & -targets), name) == 0) chosen = targets & -targets;
  }
  hwy::SetSupportedTargetsForTest(chosen);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

}  // namespace scanview
#endif
