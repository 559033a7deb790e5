#pragma once
#include "viewer/visibility/visibility_field.h"

namespace scanview {

struct HiddenCellOptions {
  int voxels = 160;    ///< along the model's longest side (SolidInterior)
  int intervals = 4;   ///< of distances, even in one over the distance
  double nearest = 2;  ///< radii; nearer eyes see everything
};

/// The rows of conservative mode: a patch is seen from a cell (a face of the sphere, an interval of distances up to
/// infinity) unless it is proven hidden from each of its eyes.
///
/// The proof is Wonka's (Wonka, Wimmer and Schmalstieg 2000), with solid space for occluders: rays from a patch's ball
/// (radius r) to the eyes of a cell spread by an angle s about their middle direction. At distance t along it they all
/// run through a ball of radius r + 2 t sin(s / 2). If that ball lies inside the solid, each ray has to leave it
/// through the surface, and the patch is hidden; unless some ray may leave through a hole (SolidInterior::windows()).
///
/// Gives lookup (rows_are_cells) and rows of a field whose center, radius and patches are set. drawn: its drawn_mesh();
/// opaque: how many of its triangles can hide anything. Cost: patches × cells × a few steps.
void find_hidden_cells(VisibilityField& field, TriangleMesh const& drawn, std::size_t opaque, SampleSphere sphere,
                       HiddenCellOptions const& options, Context& context);

}  // namespace scanview
