// Scans a built-in object, meshes the views and renders one picture, with nothing but the installed package.
#include <cstdio>
#include <memory>

#include "mesh/view_mesh.h"
#include "register/alignment.h"
#include "synth/scanner.h"
#include "viewer/view_based/view_based_renderer.h"

int main() {
  using namespace scanview;
  Context context;
  SynthOptions options;
  options.views = 4;
  options.width = 80;
  options.height = 60;
  ScanSet set = synthesize(builtin_model("statuette"), options, context).set;
  RegisterOptions keep;
  keep.refine = false;
  if (align(set, keep, context).object_from_camera.size() != set.views.size()) return 1;
  std::vector<ViewMesh> meshes;
  for (auto const& view : set.views) meshes.push_back(mesh_range_image(view.image, {}, context).view_mesh);
  auto const renderer = make_cpu_renderer(std::make_shared<scanview::ViewLibrary>(set, meshes));
  Frame const frame = renderer->render(set.views[0].image.camera, *set.views[0].object_from_camera);
  int drawn = 0;
  for (int y = 0; y < frame.color.rows; ++y)
    for (int x = 0; x < frame.color.cols; ++x) drawn += frame.color(y, x)[3] > 0;
  std::printf("%d pixels drawn\n", drawn);
  return drawn > 100 ? 0 : 1;
}
