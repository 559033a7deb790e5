#pragma once
#include <opencv2/core/mat.hpp>

namespace scanview {

/// What psnr() gives for equal pictures, so that figures stay finite.
inline constexpr double kIdenticalPsnr = 99;

/// Peak signal-to-noise ratio in dB, 10 log10(255² / mean squared difference), over the three channels of the pixels
/// where `mask` is not 0; 8-bit sRGB. At most kIdenticalPsnr; 0 where the mask is empty. All of one size.
double psnr(cv::Mat3b const& a, cv::Mat3b const& b, cv::Mat1b const& mask);

/// Mean structural similarity (Wang, Bovik, Sheikh, Simoncelli 2004) of the luminance over the pixels of `mask`:
/// Gaussian window of 11 x 11 pixels with standard deviation 1.5, K1 = 0.01, K2 = 0.03. The windows count pixels of the
/// mask only (their weights normalised), so that what lies outside has no influence. 1: equal; 0 where the mask is
/// empty.
double ssim(cv::Mat3b const& a, cv::Mat3b const& b, cv::Mat1b const& mask);

}  // namespace scanview
