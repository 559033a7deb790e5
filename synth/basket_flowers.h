#pragma once
#include <vector>

#include "synth/assembly.h"

namespace scanview {

/// What grows out of the basket (basket_weave.h): moss, and on stems gerberas, daisies, a poppy, roses, tulips,
/// lavender, forget-me-nots, leaves, and a trailing twig of ivy.
std::vector<Solid> basket_flowers();

}  // namespace scanview
