#include "mesh/gltf_accessors.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "base/error.h"
#include "mesh/file_beside.h"

// Khronos, "glTF 2.0 Specification": §3.6 binary data storage, §3.11 (normalized integers), RFC 2397 and 4648 (data
// URIs).

namespace scanview {
namespace {

enum ComponentType {
  kInt8 = 5120,
  kUint8 = 5121,
  kInt16 = 5122,
  kUint16 = 5123,
  kUint32 = 5125,
  kFloat32 = 5126,
};

std::size_t size_of(std::size_t type) {
  switch (type) {
    case kInt8:
    case kUint8:
      return 1;
    case kInt16:
    case kUint16:
      return 2;
    case kUint32:
    case kFloat32:
      return 4;
    default:
      return 0;
  }
}

template <typename Number>
double load(char const* raw) {
  Number number;
  std::memcpy(&number, raw, sizeof number);
  return double(number);
}

double load(char const* raw, std::size_t type) {
  switch (type) {
    case kInt8:
      return load<std::int8_t>(raw);
    case kUint8:
      return load<std::uint8_t>(raw);
    case kInt16:
      return load<std::int16_t>(raw);
    case kUint16:
      return load<std::uint16_t>(raw);
    case kUint32:
      return load<std::uint32_t>(raw);
    default:
      return load<float>(raw);
  }
}

/// What stands for 1 in a normalized integer.
double greatest(std::size_t type) {
  switch (type) {
    case kInt8:
      return 127;
    case kUint8:
      return 255;
    case kInt16:
      return 32767;
    case kUint16:
      return 65535;
    default:
      return 1;
  }
}

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  return c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
}

std::string percent_decoded(std::string_view text) {
  std::string result;
  for (std::size_t i = 0; i < text.size(); ++i) {
    bool const escape =
        text[i] == '%' && i + 2 < text.size() && hex_digit(text[i + 1]) >= 0 && hex_digit(text[i + 2]) >= 0;
    result.push_back(escape ? char(16 * hex_digit(text[i + 1]) + hex_digit(text[i + 2])) : text[i]);
    if (escape) i += 2;
  }
  return result;
}

/// Up to the padding or to what is no digit.
std::string base64_decoded(std::string_view text) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::array<int, 256> value;
  value.fill(-1);
  for (std::size_t i = 0; i < kDigits.size(); ++i) value[static_cast<unsigned char>(kDigits[i])] = int(i);
  std::string bytes;
  unsigned bits = 0;
  int count = 0;
  for (char const c : text) {
    int const digit = value[static_cast<unsigned char>(c)];
    if (digit < 0) break;
    bits = (bits << 6 | unsigned(digit)) & 0xffffff;
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes.push_back(char(bits >> count & 255));
  }
  return bytes;
}

}  // namespace

std::size_t gltf_size(Json const& number, char const* name, std::filesystem::path const& path) {
  constexpr double kExact = 9007199254740992;  // 2^53
  double const value = number.is_number() ? number.get<double>() : -1;
  if (!(value >= 0 && value <= kExact) || value != std::floor(value))
    throw Error(ErrorCode::bad_input, path, fmt::format("'{}' is no count", name));
  return std::size_t(value);
}

std::size_t gltf_size(Json const& object, char const* key, std::size_t otherwise, std::filesystem::path const& path) {
  auto const field = object.find(key);
  return field == object.end() ? otherwise : gltf_size(*field, key, path);
}

std::string_view GltfAccessors::buffer(std::size_t index) {
  Json const& entry = gltf_.at("buffers").at(index);
  if (!entry.contains("uri")) {
    if (index == 0 && !binary_.empty()) return binary_;
    throw Error(ErrorCode::bad_input, path_, fmt::format("buffer {} has no bytes", index));
  }
  auto const [place, is_new] = buffers_.try_emplace(index);
  if (is_new) place->second = uri_bytes(entry.at("uri").get_ref<std::string const&>());
  return place->second;
}

std::string GltfAccessors::uri_bytes(std::string const& uri) const {
  constexpr std::string_view kBase64 = ";base64,";
  if (std::size_t const at = uri.find(kBase64); uri.starts_with("data:") && at != std::string::npos)
    return base64_decoded(std::string_view(uri).substr(at + kBase64.size()));
  return read_file(file_beside(path_, percent_decoded(uri)));
}

std::optional<std::string_view> GltfAccessors::part_of_buffer(std::size_t index) {
  Json const& view = gltf_.at("bufferViews").at(index);
  std::size_t const start = gltf_size(view, "byteOffset", 0, path_), length = gltf_size(view, "byteLength", 0, path_);
  std::string_view const bytes = buffer(gltf_size(view, "buffer", 0, path_));
  if (start > bytes.size() || length > bytes.size() - start) return std::nullopt;
  return bytes.substr(start, length);
}

std::string_view GltfAccessors::view_bytes(std::size_t index) {
  auto const bytes = part_of_buffer(index);
  if (!bytes) throw Error(ErrorCode::bad_input, path_, fmt::format("buffer view {} ends after its bytes", index));
  return *bytes;
}

std::vector<double> GltfAccessors::numbers(std::size_t index, std::string_view type, std::size_t components) {
  Json const& accessor = gltf_.at("accessors").at(index);
  auto const fail = [&](std::string const& what) {
    throw Error(ErrorCode::bad_input, path_, fmt::format("accessor {} {}", index, what));
  };
  constexpr std::size_t kNone = SIZE_MAX;
  std::size_t const view_index = gltf_size(accessor, "bufferView", kNone, path_);
  if (accessor.contains("sparse") || view_index == kNone) fail("is sparse: this is not read");
  if (accessor.at("type").get_ref<std::string const&>() != type) fail(fmt::format("is not of type {}", type));
  Json const& view = gltf_.at("bufferViews").at(view_index);

  std::size_t const component = gltf_size(accessor, "componentType", 0, path_);
  std::size_t const element = size_of(component) * components;
  if (element == 0) fail("is of an unknown component type");
  std::size_t const count = gltf_size(accessor, "count", 0, path_);
  std::size_t const stride = gltf_size(view, "byteStride", element, path_);
  std::size_t const offset = gltf_size(accessor, "byteOffset", 0, path_);
  auto const part = part_of_buffer(view_index);
  if (!part || offset > part->size()) fail("begins after its bytes end");
  std::string_view const bytes = *part;
  if (count == 0) return {};
  if (element > bytes.size() - offset || stride < element || (count - 1) > (bytes.size() - offset - element) / stride)
    fail("promises more than there is");

  bool const is_float = component == kFloat32;
  bool const normalized = !is_float && accessor.value("normalized", false);
  std::vector<double> result;
  result.reserve(count * components);
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t c = 0; c < components; ++c) {
      double const value = load(bytes.data() + offset + i * stride + c * size_of(component), component);
      result.push_back(normalized ? std::max(value / greatest(component), -1.0) : value);
    }
  return result;
}

std::vector<Eigen::Vector3d> GltfAccessors::positions(std::size_t accessor) {
  std::vector<double> const values = numbers(accessor, "VEC3", 3);
  std::vector<Eigen::Vector3d> result;
  for (std::size_t i = 0; i + 2 < values.size(); i += 3) result.emplace_back(values[i], values[i + 1], values[i + 2]);
  return result;
}

std::vector<Eigen::Vector2f> GltfAccessors::texture_coordinates(std::size_t accessor) {
  std::vector<double> const values = numbers(accessor, "VEC2", 2);
  std::vector<Eigen::Vector2f> result;
  for (std::size_t i = 0; i + 1 < values.size(); i += 2) result.emplace_back(float(values[i]), float(values[i + 1]));
  return result;
}

std::vector<std::int64_t> GltfAccessors::indices(std::size_t accessor) {
  std::vector<std::int64_t> result;
  for (double const value : numbers(accessor, "SCALAR", 1)) {
    // Whatever is beyond 32 bits, or no index at all, is no vertex either.
    bool const fits = value >= 0 && value <= double(UINT32_MAX) && value == std::floor(value);
    result.push_back(fits ? std::int64_t(value) : -1);
  }
  return result;
}

}  // namespace scanview
