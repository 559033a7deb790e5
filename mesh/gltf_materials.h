#pragma once
#include <Eigen/Geometry>
#include <map>
#include <vector>

#include "mesh/gltf_accessors.h"
#include "mesh/model_pictures.h"

namespace scanview {

/// The base colours of a glTF file's materials: baseColorFactor, and baseColorTexture as KHR_texture_transform has it.
/// What cannot be read of a texture is a note of the builder's.
class GltfMaterials {
 public:
  /// All must outlive this.
  GltfMaterials(Json const& gltf, GltfAccessors& accessors, std::filesystem::path const& path, ModelBuilder& builder)
      : gltf_(gltf), accessors_(accessors), path_(path), builder_(builder), pictures_(builder) {}

  struct Surface {
    Light light = Light::stops;
    std::int32_t number = -1;         ///< the builder's
    std::vector<Eigen::Vector2f> at;  ///< where each vertex lies in its picture; empty: it has none
  };
  /// Of a primitive. Throws, as GltfAccessors does, where the material is not there.
  Surface surface(Json const& primitive);

 private:
  struct Material {
    Light light = Light::stops;
    std::int32_t number = -1;
    std::string coordinates;  ///< the attribute's name; empty: no picture
    Eigen::Affine2f picture_from_coordinates = Eigen::Affine2f::Identity();
  };

  Material const& material(std::size_t index);
  ModelTexture texture(std::size_t index);
  cv::Mat3b picture(std::size_t image);

  Json const& gltf_;
  GltfAccessors& accessors_;
  std::filesystem::path const& path_;
  ModelBuilder& builder_;
  ModelPictures pictures_;
  std::map<std::size_t, Material> known_;
};

}  // namespace scanview
