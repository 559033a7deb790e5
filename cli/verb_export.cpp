#include <CLI/CLI.hpp>
#include <array>
#include <memory>
#include <numeric>
#include <utility>

#include "acquire/export.h"
#include "acquire/scan_set_file.h"
#include "cli/stages.h"
#include "mesh/textured_mesh.h"
#include "register/pose_file.h"

namespace scanview {
namespace {

void export_glb(std::filesystem::path const& path, std::filesystem::path const& folder, ScanSet const& set,
                Context& context) {
  auto const meshes = read_view_meshes(folder, set, context);
  std::vector<ViewMesh const*> pointers;
  for (auto const& mesh : meshes) pointers.push_back(&mesh);
  std::vector<std::size_t> indices(meshes.size());
  std::iota(indices.begin(), indices.end(), std::size_t{0});
  write_file(path, encode_glb(pointers, set, indices));
}

void export_obj(std::filesystem::path const& path, std::filesystem::path const& folder, ScanSet const& set,
                Context& context) {
  auto const meshes = read_view_meshes(folder, set, context);
  std::filesystem::create_directories(path);
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    ObjFiles const files = encode_obj(meshes[i], set.views[i]);
    std::filesystem::path const name = path / set.views[i].name;
    write_file(name.string() + ".obj", files.obj);
    if (files.mtl.empty()) continue;
    write_file(name.string() + ".mtl", files.mtl);
    write_file(name.string() + ".jpg", files.jpeg);
  }
}

constexpr std::array kPoseFormats = {std::pair{"conf", PoseFormat::conf}, std::pair{"aln", PoseFormat::aln},
                                     std::pair{"tum", PoseFormat::tum}, std::pair{"redwood", PoseFormat::redwood}};

}  // namespace

void add_export(CLI::App& app, Session& session) {
  struct Arguments {
    std::filesystem::path set, output;
    std::string kind;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb = app.add_subcommand("export", "A scan set for other programs");
  verb->add_option("set", arguments->set, "The scan set")->required();
  verb->add_option(
          "--to", arguments->kind,
          "ply (merged coloured points), glb (all views' meshes), obj (a folder with a textured mesh a view), colmap "
          "(text model, depth maps), nerfstudio "
          "(transforms.json); poses alone: conf (Stanford), aln (MeshLab, with the set's meshes), tum, redwood "
          "(trajectories)")
      ->required()
      ->check(CLI::IsMember({"ply", "glb", "obj", "colmap", "nerfstudio", "conf", "aln", "tum", "redwood"}));
  verb->add_option("-o,--output", arguments->output, "Folder (obj, colmap, nerfstudio) or file (all others)")
      ->required();
  verb->callback([arguments, &session] {
    session.verb = "export";
    session.work = [arguments, &session] {
      Context& context = session.context;
      ScanSet set = read_manifest(arguments->set);
      require_poses(arguments->set, set);
      session.report["views"] = set.views.size();
      session.report["output"] = arguments->output.string();
      for (auto const& [name, format] : kPoseFormats)
        if (arguments->kind == name) return write_poses(arguments->output, format, set, arguments->set);
      set = read_scan_set(arguments->set, context);
      if (arguments->kind == "ply") export_point_cloud(arguments->output, set, context);
      if (arguments->kind == "glb") export_glb(arguments->output, arguments->set, set, context);
      if (arguments->kind == "obj") export_obj(arguments->output, arguments->set, set, context);
      if (arguments->kind == "colmap") export_colmap(arguments->output, set, context);
      if (arguments->kind == "nerfstudio") export_nerfstudio(arguments->output, set, context);
    };
  });
}

}  // namespace scanview
