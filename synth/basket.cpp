#include "synth/basket.h"

#include "synth/assembly.h"
#include "synth/basket_flowers.h"
#include "synth/basket_weave.h"
#include "synth/paint.h"

namespace scanview {

TriangleMesh make_basket(float spacing_mm, Context& context) {
  std::vector<Solid> solids = basket_weave();
  for (Solid const& solid : basket_flowers()) solids.push_back(solid);
  for (Solid& solid : solids)
    solid.paint = [paint = solid.paint](Eigen::Vector3f const& p) { return within_albedo(paint(p)); };
  Eigen::AlignedBox3f const box(Eigen::Vector3f(-60, -3, -60), Eigen::Vector3f(60, 136, 60));
  // Bent stems and petals overestimate the distance by up to a third.
  float const slack = 1.4f;
  return make_assembly(solids, box, spacing_mm, slack, context);
}

}  // namespace scanview
