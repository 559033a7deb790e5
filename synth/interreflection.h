#pragma once
#include "base/random.h"
#include "synth/capture_scene.h"

namespace scanview {

/// Adds to every frame the beam's light that comes to a point of the object by way of one other surface: diffuse from
/// 64 directions, and, where the surface is glossy, mirrored from one. `frames` as in ProjectedLight::add; `weight`
/// scales all. Two packets of rays a packet of directions.
void add_interreflection(CaptureScene const& scene, int view, SceneSample const& point,
                         Eigen::Vector3d const& direction, ProjectedLight const& light, float gloss, float weight,
                         CounterRandom random, float* frames);

}  // namespace scanview
