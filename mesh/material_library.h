#pragma once
#include <Eigen/Core>
#include <filesystem>
#include <opencv2/core/matx.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "mesh/model_builder.h"

namespace scanview {

/// A picture that a material names: at a vertex's texture coordinates, v up, times `scale` plus `offset`.
struct MaterialMap {
  std::string file;
  TextureWrap wrap = TextureWrap::repeat;
  Eigen::Vector2f scale = Eigen::Vector2f::Ones(), offset = Eigen::Vector2f::Zero();
};

struct LibraryMaterial {
  std::string name;
  Light light = Light::stops;      ///< passes: `d` below 1, or, without `d`, `Tr` above 0, or a `map_d`
  std::optional<cv::Vec3b> color;  ///< `Kd`, taken for sRGB; B G R
  std::optional<MaterialMap> map;  ///< `map_Kd`
};

/// The materials of the Wavefront material libraries of a model's `mtllib` line, as they follow each other; names may
/// be there twice. The files are looked for in the model's folder and below it. Throws Error{bad_input} where one is
/// not there.
std::vector<LibraryMaterial> read_material_libraries(std::string_view mtllib, std::filesystem::path const& model);

}  // namespace scanview
