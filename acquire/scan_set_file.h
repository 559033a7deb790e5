#pragma once
#include <filesystem>
#include <set>
#include <string>

#include "acquire/scan_set.h"
#include "base/context.h"
#include "base/files.h"

namespace scanview {

/// scanset.json alone, which `path` is or lies in: unit, centre, views with cameras and poses (their images empty),
/// error budget. Everything is validated: unknown unit, missing or bad camera, non-finite or non-rigid pose, doubled or
/// unsafe view name (a name is letters, digits, '_', '-', '.', not starting with '.') throw Error{bad_input}.
ScanSet read_manifest(std::filesystem::path const& path);
/// Rewrites scanset.json (whole or not at all) from the set; images are left alone.
void write_manifest(std::filesystem::path const& folder, ScanSet const& set);

/// The manifest and all images (in parallel). Sizes that do not fit the camera are errors that name the file.
ScanSet read_scan_set(std::filesystem::path const& folder, Context& context);
/// Writes manifest and images into an existing folder (usually NewFolder::path()).
void write_scan_set(std::filesystem::path const& folder, ScanSet const& set, Context& context);

/// views/NAME/..., relative to the set's folder.
std::filesystem::path view_folder(std::string const& view_name);

/// Relative paths of the image files of all views, for hashes.
std::vector<std::filesystem::path> image_files(ScanSet const& set);

/// 32-bit float channels Z and S (and any others are ignored on reading). NaN = missing. ZIPS compression.
void write_range_exr(std::filesystem::path const& path, cv::Mat1f const& depth, cv::Mat1f const& sigma);
void read_range_exr(std::filesystem::path const& path, cv::Mat1f& depth, cv::Mat1f& sigma);
/// One channel Z (rendered depth). Reading takes any file that has it.
void write_depth_exr(std::filesystem::path const& path, cv::Mat1f const& depth);
cv::Mat1f read_depth_exr(std::filesystem::path const& path);

}  // namespace scanview
