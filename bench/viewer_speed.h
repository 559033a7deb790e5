#pragma once

namespace scanview {

/// Prints CPU and wall milliseconds a frame of both back ends, measured in turns, for three (and seven) views of about
/// 20 000 and 100 000 triangles at 800 x 800 pixels, the object covering about 70 % of them.
void bench_speed(int frames);

}  // namespace scanview
