#include "mesh/gltf_materials.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "base/srgb.h"

// Khronos, "glTF 2.0 Specification": §3.8 texture data, §3.9 materials; extensions KHR_texture_transform,
// EXT_texture_webp, KHR_materials_transmission.

namespace scanview {
namespace {

constexpr std::size_t kNone = SIZE_MAX;

Json const& object_of(Json const& parent, char const* key) {
  static Json const kEmpty = Json::object();
  auto const found = parent.find(key);
  return found == parent.end() ? kEmpty : *found;
}

Light light_of(Json const& material) {
  if (material.value("alphaMode", "OPAQUE") != "OPAQUE") return Light::passes;
  Json const& transmission = object_of(object_of(material, "extensions"), "KHR_materials_transmission");
  return transmission.value("transmissionFactor", 0.0) > 0 ? Light::passes : Light::stops;
}

/// Linear R G B in [0, 1].
std::optional<Eigen::Vector3f> factor_of(Json const& base) {
  auto const field = base.find("baseColorFactor");
  if (field == base.end()) return std::nullopt;
  auto const rgba = field->get<std::array<double, 4>>();
  return Eigen::Vector3d(rgba[0], rgba[1], rgba[2]).cwiseMax(0).cwiseMin(1).cast<float>();
}

cv::Vec3b srgb8_of(Eigen::Vector3f const& linear) {
  cv::Vec3b bgr;
  for (int c = 0; c < 3; ++c) bgr[c] = uchar(std::lround(255 * srgb_from_linear(linear[2 - c])));
  return bgr;
}

TextureWrap wrap_of(std::size_t code) {
  constexpr std::size_t kClampToEdge = 33071, kMirroredRepeat = 33648;
  if (code == kClampToEdge) return TextureWrap::clamp;
  return code == kMirroredRepeat ? TextureWrap::mirrored : TextureWrap::repeat;
}

/// v is down: a positive angle turns against the clock as one looks at the picture.
Eigen::Affine2f transform_of(Json const& info) {
  auto const pair = [&info](char const* key, std::array<float, 2> const& otherwise) {
    auto const values = info.value(key, otherwise);
    return Eigen::Vector2f(values[0], values[1]);
  };
  return Eigen::Translation2f(pair("offset", {0, 0})) * Eigen::Rotation2Df(-info.value("rotation", 0.0f)) *
         Eigen::Scaling(pair("scale", {1, 1}));
}

}  // namespace

cv::Mat3b GltfMaterials::picture(std::size_t index) {
  Json const& image = gltf_.at("images").at(index);
  auto const uri = image.find("uri");
  bool const in_file = uri != image.end() && !uri->get_ref<std::string const&>().starts_with("data:");
  return pictures_.named(in_file ? uri->get<std::string>() : fmt::format("image {}", index), [&] {
    if (uri != image.end()) return accessors_.uri_bytes(uri->get_ref<std::string const&>());
    return std::string(accessors_.view_bytes(gltf_size(image.at("bufferView"), "bufferView", path_)));
  });
}

ModelTexture GltfMaterials::texture(std::size_t index) {
  Json const& entry = gltf_.at("textures").at(index);
  Json const& webp = object_of(object_of(entry, "extensions"), "EXT_texture_webp");
  std::size_t const image = gltf_size(webp, "source", gltf_size(entry, "source", kNone, path_), path_);
  if (image == kNone) throw Error(ErrorCode::bad_input, path_, fmt::format("texture {} has no picture we read", index));
  ModelTexture result{.picture = picture(image)};
  if (std::size_t const at = gltf_size(entry, "sampler", kNone, path_); at != kNone) {
    Json const& sampler = gltf_.at("samplers").at(at);
    result.wrap_u = wrap_of(gltf_size(sampler, "wrapS", 0, path_));
    result.wrap_v = wrap_of(gltf_size(sampler, "wrapT", 0, path_));
  }
  return result;
}

GltfMaterials::Material const& GltfMaterials::material(std::size_t index) {
  auto const [place, is_new] = known_.try_emplace(index);
  Material& result = place->second;
  if (!is_new) return result;
  Json const& material = gltf_.at("materials").at(index);
  result.light = light_of(material);
  ModelMaterial added;
  auto const note = [&](std::string const& why) {
    builder_.note(fmt::format("material {}: its base colour was left out: {}", index, why));
  };
  try {
    Json const& base = object_of(material, "pbrMetallicRoughness");
    std::optional<Eigen::Vector3f> const factor = factor_of(base);
    if (factor) added.color = srgb8_of(*factor);
    if (Json const& info = object_of(base, "baseColorTexture"); !info.empty()) {
      Json const& moved = object_of(object_of(info, "extensions"), "KHR_texture_transform");
      std::size_t const set = gltf_size(moved, "texCoord", gltf_size(info, "texCoord", 0, path_), path_);
      result.picture_from_coordinates = transform_of(moved);
      ModelTexture found = texture(gltf_size(info.at("index"), "index", path_));
      found.factor = factor.value_or(found.factor);
      if (!found.picture.empty()) {
        result.coordinates = fmt::format("TEXCOORD_{}", set);
        added.texture = std::move(found);
      }
    }
  } catch (Error const& error) {
    note(error.message());
  } catch (Json::exception const& error) {
    note(error.what());
  }
  result.number = builder_.add_material(std::move(added));
  return result;
}

GltfMaterials::Surface GltfMaterials::surface(Json const& primitive) {
  std::size_t const index = gltf_size(primitive, "material", kNone, path_);
  if (index == kNone) return {};
  Material const& used = material(index);
  Surface result{used.light, used.number, {}};
  Json const& attributes = primitive.at("attributes");
  if (used.coordinates.empty() || !attributes.contains(used.coordinates)) return result;
  auto const note = [&](std::string const& why) {
    builder_.note(fmt::format("texture coordinates were left out: {}", why));
  };
  try {
    result.at = accessors_.texture_coordinates(gltf_size(attributes, used.coordinates.c_str(), kNone, path_));
  } catch (Error const& error) {
    note(error.message());
  } catch (Json::exception const& error) {
    note(error.what());
  }
  for (Eigen::Vector2f& at : result.at) at = used.picture_from_coordinates * at;
  return result;
}

}  // namespace scanview
