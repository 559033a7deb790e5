#pragma once
#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "acquire/scan_set.h"
#include "base/context.h"

namespace scanview {

/// What to keep of a scene where the data has no masks.
struct ImportOptions {
  /// Keep only points inside this box, in object coordinates: min, max (first camera's coordinates where no poses).
  std::optional<std::array<Eigen::Vector3d, 2>> box;
  /// Remove the dominant plane (RANSAC with our own seeded sampler) and all behind it, seen from the cameras.
  bool cut_ground = false;
  /// Depths outside are dropped, in units.
  double min_depth = 0;
  double max_depth = std::numeric_limits<double>::infinity();
  /// Where the camera was fixed (rgbd.json "fixed_camera"): remove what stays the same in colour and depth. Also
  /// possible without the key, when asked for.
  enum class Background { automatic, keep, remove_static } background = Background::automatic;
  /// Every so many frames only; 1: all.
  int step = 1;
  void validate() const;
};

struct ImportResult {
  ScanSet set;
  std::size_t depths = 0;
  std::size_t background_removed = 0;             ///< pixels that had a depth
  std::vector<std::string> failed_views;          ///< named; the rest is there (exit 6)
  std::vector<std::filesystem::path> files_read;  ///< everything that decided the result, for hashes
};

/// Colour + 16-bit depth + intrinsics: a folder with rgbd.json (DESIGN §3), or a known layout: 7-Scenes
/// (frame-NNNNNN.color/.depth/.pose), TUM (rgb.txt, depth.txt, groundtruth.txt), Redwood/Open3D (color|image|rgb,
/// depth, camera_intrinsic.json, trajectory .log). Lens distortion is removed; a depth camera of its own is reprojected
/// with a z-buffer.
ImportResult import_rgbd(std::filesystem::path const& path, ImportOptions const& options, Context& context);
/// Stanford range_grid PLY scans + .conf: folder, .conf or archive (.tar.gz, .tar.xz, .zip).
ImportResult import_stanford(std::filesystem::path const& path, ImportOptions const& options, Context& context);
/// nerfstudio / instant-ngp transforms.json with depth_file_path.
ImportResult import_nerfstudio(std::filesystem::path const& path, ImportOptions const& options, Context& context);
/// COLMAP text model (cameras.txt, images.txt) with depth maps (stereo/depth_maps/NAME.geometric.bin or
/// .photometric.bin).
ImportResult import_colmap(std::filesystem::path const& path, ImportOptions const& options, Context& context);

// The poses alone of what these two read, as a set whose views have a name (the one that import gives them) and a pose,
// but no camera and no picture. Every pose must be one: else Error{bad_input} naming file and frame.

/// images.txt of a COLMAP text model.
ScanSet read_colmap_poses(std::filesystem::path const& path);
/// transforms.json; its "unit" is the set's, `arbitrary` where it names none.
ScanSet read_nerfstudio_poses(std::filesystem::path const& path);
/// The images.txt of a COLMAP workspace or model folder; empty where there is none.
std::filesystem::path find_colmap_images(std::filesystem::path const& folder);

/// "rgbd", "stanford", "nerfstudio", "colmap": what `path` looks like; empty where it is none of these.
std::string guess_import_kind(std::filesystem::path const& path);

/// Pictures of every view (colour, depth, mask) and what was removed.
struct ReportSection import_section(ScanSet const& set);

}  // namespace scanview
