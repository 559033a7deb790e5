#include "base/image_file.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "base/animated_png.h"
#include "base/files.h"
#include "base/gray_png.h"
#include "tests/expect_error.h"
#include "tests/temporary_folder.h"

namespace scanview {
namespace {

cv::Mat gradient(int type) {
  cv::Mat image(37, 53, type);
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols * image.channels(); ++x)
      if (image.depth() == CV_8U)
        image.ptr<std::uint8_t>(y)[x] = static_cast<std::uint8_t>(x * 7 + y * 13);
      else
        image.ptr<std::uint16_t>(y)[x] = static_cast<std::uint16_t>(x * 1009 + y * 773);
  return image;
}

TEST(ImageFile, PngKeepsEveryPixel) {
  TemporaryFolder folder;
  for (int const type : {CV_8UC1, CV_8UC3, CV_8UC4, CV_16UC1}) {
    cv::Mat const image = gradient(type);
    write_file(folder.path() / "i.png", encode_png(image));
    cv::Mat const back = read_image(folder.path() / "i.png");
    ASSERT_EQ(back.type(), type);
    EXPECT_EQ(cv::norm(back, image, cv::NORM_INF), 0);
  }
}

TEST(ImageFile, ColorOfAnyPicture) {
  TemporaryFolder folder;
  write_file(folder.path() / "gray16.png", encode_png(cv::Mat(4, 5, CV_16UC1, cv::Scalar(257 * 100))));
  cv::Mat3b const color = read_color(folder.path() / "gray16.png");
  EXPECT_EQ(color.size(), cv::Size(5, 4));
  EXPECT_EQ(color(2, 2), cv::Vec3b(100, 100, 100));
}

TEST(ImageFile, EveryTruncatedPictureIsRefused) {
  TemporaryFolder folder;
  for (std::string const& bytes :
       {encode_png(gradient(CV_8UC3)), encode_png(gradient(CV_16UC1)), encode_jpeg(gradient(CV_8UC3))})
    for (std::size_t n = 0; n + 2 < bytes.size(); n += std::max<std::size_t>(1, bytes.size() / 50)) {
      write_file(folder.path() / "cut", bytes.substr(0, n));
      EXPECT_SCANVIEW_ERROR(read_image(folder.path() / "cut"), ErrorCode::bad_input, "cut");
    }
}

/// Noise makes libpng choose among all five filters, from line to line.
cv::Mat noisy(int type, int rows, int cols, int strength) {
  cv::Mat image(rows, cols, type), noise(rows, cols, type);
  cv::RNG random(7);
  random.fill(noise, cv::RNG::UNIFORM, 0, strength);
  for (int y = 0; y < rows; ++y) image.row(y).setTo(y * 3 % 200);
  return image + noise;
}

TEST(GrayPng, IsWhatTheLibraryReads) {
  for (int const type : {CV_8UC1, CV_16UC1})
    for (int const strength : {1, 3, 50, 255})
      for (auto const& size : {cv::Size(1, 1), cv::Size(1, 40), cv::Size(40, 1), cv::Size(63, 48)}) {
        std::string const bytes = encode_png(noisy(type, size.height, size.width, strength));
        auto const ours = decode_gray_png(bytes);
        ASSERT_TRUE(ours);
        cv::Mat const library =
            cv::imdecode(std::vector<unsigned char>(bytes.begin(), bytes.end()), cv::IMREAD_UNCHANGED);
        ASSERT_EQ(ours->type(), library.type());
        EXPECT_EQ(cv::norm(*ours, library, cv::NORM_INF), 0);
      }
}

TEST(GrayPng, OtherKindsAreLeftToTheLibrary) {
  EXPECT_FALSE(decode_gray_png(encode_png(gradient(CV_8UC3))));
  EXPECT_FALSE(decode_gray_png(encode_jpeg(gradient(CV_8UC1))));
  EXPECT_FALSE(decode_gray_png(""));
}

TEST(GrayPng, AnyChangedByteIsFound) {
  // Every byte but the eight of the magic number stands in a chunk's length, type, data or checksum. A changed length,
  // or a changed kind of picture, makes it another file: then it is not read here, or refused.
  cv::Mat const image = gradient(CV_16UC1);
  std::string const good = encode_png(image);
  for (std::size_t i = 8; i < good.size(); ++i) {
    std::string bad = good;
    bad[i] = static_cast<char>(bad[i] ^ 0x10);
    auto const result = decode_gray_png(bad);
    EXPECT_TRUE(!result || result->empty()) << "byte " << i;
    EXPECT_FALSE(is_whole_png(bad)) << "byte " << i;
  }
}

TEST(ImageFile, WhatIsNoPictureIsRefused) {
  TemporaryFolder folder;
  write_file(folder.path() / "text.png", "hello");
  EXPECT_SCANVIEW_ERROR(read_image(folder.path() / "text.png"), ErrorCode::bad_input, "not a picture");
}

TEST(AnimatedPng, IsAPngOfItsFirstFrameThatHoldsTheOthers) {
  cv::Mat3b const red(4, 6, cv::Vec3b(0, 0, 255)), blue(4, 6, cv::Vec3b(255, 0, 0));
  std::string const film = animated_png({encode_png(red), encode_png(blue), encode_png(red)}, 40);
  ASSERT_TRUE(is_whole_png(film));
  cv::Mat const first = cv::imdecode(std::vector<char>(film.begin(), film.end()), cv::IMREAD_COLOR);
  EXPECT_EQ(cv::norm(first, red, cv::NORM_INF), 0);
  // One control chunk a frame, and one data chunk at least of each frame but the first.
  auto const count = [&](std::string const& type) {
    std::size_t found = 0;
    for (std::size_t at = film.find(type); at != std::string::npos; at = film.find(type, at + 4)) ++found;
    return found;
  };
  EXPECT_EQ(count("acTL"), 1U);
  EXPECT_EQ(count("fcTL"), 3U);
  EXPECT_GE(count("fdAT"), 2U);
  EXPECT_THROW(animated_png({}, 40), std::logic_error);
  EXPECT_THROW(animated_png({encode_png(red), encode_png(cv::Mat3b(3, 6, cv::Vec3b()))}, 40), std::logic_error);
  EXPECT_THROW(animated_png({"no picture"}, 40), std::logic_error);
}

}  // namespace
}  // namespace scanview
