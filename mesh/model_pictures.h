#pragma once
#include <functional>
#include <map>
#include <opencv2/core/mat.hpp>
#include <string>
#include <string_view>

#include "mesh/model_builder.h"

namespace scanview {

/// The pictures that a model names, each decoded once. One that is missing or damaged is an empty picture and a note.
class ModelPictures {
 public:
  explicit ModelPictures(ModelBuilder& builder) : builder_(builder) {}

  /// The one of this name; its file's bytes are asked for at the first time only.
  cv::Mat3b named(std::string const& name, std::function<std::string()> const& bytes);
  /// A file in the model's folder or below it (`file_beside`).
  cv::Mat3b beside(std::filesystem::path const& model, std::string_view file);

 private:
  ModelBuilder& builder_;
  std::map<std::string, cv::Mat3b> known_;
};

}  // namespace scanview
