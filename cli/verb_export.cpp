#include <CLI/CLI.hpp>
#include <memory>
#include <numeric>

#include "acquire/export.h"
#include "acquire/scan_set_file.h"
#include "base/error.h"
#include "cli/stages.h"

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

}  // namespace

void add_export(CLI::App& app, Session& session) {
  struct Arguments {
    std::filesystem::path set, output;
    std::string kind;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb = app.add_subcommand("export", "A scan set for other programs");
  verb->add_option("set", arguments->set, "The scan set")->required();
  verb->add_option("--to", arguments->kind,
                   "ply (merged coloured points), glb (all views' meshes), colmap (text model, depth maps), nerfstudio "
                   "(transforms.json)")
      ->required()
      ->check(CLI::IsMember({"ply", "glb", "colmap", "nerfstudio"}));
  verb->add_option("-o,--output", arguments->output, "File (ply, glb) or folder")->required();
  verb->callback([arguments, &session] {
    session.verb = "export";
    session.work = [arguments, &session] {
      Context& context = session.context;
      ScanSet const set = read_scan_set(arguments->set, context);
      if (!set.has_poses())
        throw Error(ErrorCode::bad_input, arguments->set, "has views without poses (run 'scanview register' first)");
      if (arguments->kind == "ply") export_point_cloud(arguments->output, set, context);
      if (arguments->kind == "glb") export_glb(arguments->output, arguments->set, set, context);
      if (arguments->kind == "colmap") export_colmap(arguments->output, set, context);
      if (arguments->kind == "nerfstudio") export_nerfstudio(arguments->output, set, context);
      session.report["views"] = set.views.size();
      session.report["output"] = arguments->output.string();
    };
  });
}

}  // namespace scanview
