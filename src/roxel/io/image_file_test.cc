#include "roxel/io/image_file.h"

#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <thread>

#include "roxel/base/error.h"
#include "roxel/base/temp_folder.h"
#include "roxel/base/test_data.h"

namespace roxel {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

/// A folder of its own for every test.
class ImageFileTest : public ::testing::Test {
 protected:
  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  const TempFolder folder_;
};
using ReadImage = ImageFileTest;
using ReadMask = ImageFileTest;
using WritePng = ImageFileTest;
using WriteExr = ImageFileTest;
using BadImage = ImageFileTest;

/// Writes values (of the spec's own format) with OpenImageIO alone.
template <class T>
void store(const std::string& path, OIIO::ImageSpec spec, const std::vector<T>& values) {
  ASSERT_EQ(values.size(), spec.image_pixels() * spec.nchannels);
  const auto out = OIIO::ImageOutput::create(path);
  ASSERT_TRUE(out) << OIIO::geterror();
  ASSERT_TRUE(out->open(path, spec)) << out->geterror();
  ASSERT_TRUE(out->write_image(OIIO::BaseTypeFromC<T>::value, values.data())) << out->geterror();
  ASSERT_TRUE(out->close());
}

OIIO::ImageSpec spec(int width, int height, int channels, OIIO::TypeDesc type) {
  return OIIO::ImageSpec(width, height, channels, type);
}

std::string bytes_of(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void put_bytes(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

double srgb(double x) { return x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4); }

template <class T>
std::vector<T> ramp(int count, int step) {
  std::vector<T> values(count);
  for (int i = 0; i < count; ++i) values[i] = static_cast<T>(i * step);
  return values;
}

// --- pixels and responses

TEST_F(ReadImage, EightBitFilesAreDecodedFromSrgb) {
  const auto values = ramp<unsigned char>(8 * 4 * 3, 2);
  for (const char* name : {"a.png", "a.tif"}) {
    store(path(name), spec(8, 4, 3, OIIO::TypeUInt8), values);
    const ImageFile file = read_image(path(name));
    ASSERT_EQ(file.rgb.width(), 8);
    ASSERT_EQ(file.rgb.height(), 4);
    ASSERT_EQ(file.rgb.channels(), 3);
    for (std::size_t i = 0; i < values.size(); ++i)
      ASSERT_NEAR(file.rgb.data()[i], srgb(values[i] / 255.0), 3e-7) << name << " at " << i;
    EXPECT_EQ(file.response.curve, ResponseCurve::kSrgb);
    EXPECT_TRUE(file.alpha.empty());
    EXPECT_TRUE(file.valid.empty());
  }
}

TEST_F(ReadImage, SixteenBitFilesKeepTheirSteps) {
  const auto values = ramp<unsigned short>(8 * 4 * 3, 677);
  for (const char* name : {"a.png", "a.tif"}) {
    store(path(name), spec(8, 4, 3, OIIO::TypeUInt16), values);
    const ImageFile file = read_image(path(name));
    for (std::size_t i = 0; i < values.size(); ++i)
      ASSERT_NEAR(file.rgb.data()[i], srgb(values[i] / 65535.0), 3e-7) << name << " at " << i;
  }
}

TEST_F(ReadImage, FloatFilesAreLinearAndUnbounded) {
  std::vector<float> values(8 * 4 * 3);
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = std::ldexp(1.0f + i % 7 / 8.0f, static_cast<int>(i / 3) - 12);
  for (const char* name : {"a.exr", "a.hdr", "a.tif"}) {
    store(path(name), spec(8, 4, 3, OIIO::TypeFloat), values);
    const ImageFile file = read_image(path(name));
    EXPECT_EQ(file.response.curve, ResponseCurve::kLinear);
    // RGBE keeps 8 bits of the largest of three channels, which here differ by less than a factor of two.
    const double tolerance = std::string(name) == "a.hdr" ? 2.0 / 128 : 0;
    for (std::size_t i = 0; i < values.size(); ++i)
      ASSERT_NEAR(file.rgb.data()[i], values[i], tolerance * values[i]) << name << " at " << i;
  }
}

TEST_F(ReadImage, JpegComesCloseToWhatWasStored) {
  auto s = spec(64, 48, 3, OIIO::TypeUInt8);
  s.attribute("CompressionQuality", 98);
  std::vector<unsigned char> values;
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x)
      for (const int v : {60 + 2 * x, 90 + y, 120}) values.push_back(static_cast<unsigned char>(v));
  store(path("a.jpg"), s, values);
  const ImageFile file = read_image(path("a.jpg"));
  for (std::size_t i = 0; i < values.size(); ++i)
    ASSERT_NEAR(encode({}, file.rgb.data()[i]) * 255, values[i], 4) << i;
}

TEST_F(ReadImage, GreyIsExpanded) {
  store(path("a.png"), spec(8, 4, 1, OIIO::TypeUInt8), ramp<unsigned char>(32, 5));
  const ImageFile file = read_image(path("a.png"));
  for (int i = 0; i < 32; ++i)
    for (int c = 0; c < 3; ++c) ASSERT_NEAR(file.rgb.data()[3 * i + c], srgb(5 * i / 255.0), 3e-7);
}

TEST_F(ReadImage, ResponseOverridesTheFileType) {
  store(path("a.png"), spec(2, 1, 3, OIIO::TypeUInt8), std::vector<unsigned char>{51, 102, 153, 204, 255, 0});
  EXPECT_NEAR(read_image(path("a.png"), Response{ResponseCurve::kLinear}).rgb.pixel(0, 0)[1], 0.4, 1e-7);
  EXPECT_NEAR(read_image(path("a.png"), Response{ResponseCurve::kGamma, 2}).rgb.pixel(0, 0)[1], 0.16, 1e-7);
  store(path("a.exr"), spec(1, 1, 3, OIIO::TypeFloat), std::vector<float>{0.5f, 2, -0.5f});
  const ImageFile file = read_image(path("a.exr"), Response{ResponseCurve::kSrgb});
  EXPECT_NEAR(file.rgb.data()[0], srgb(0.5), 1e-6);
  EXPECT_NEAR(file.rgb.data()[2], -srgb(0.5), 1e-6);
}

TEST_F(ReadImage, AlphaComesApartAndDoesNotDarken) {
  for (const char* name : {"a.png", "a.tif"}) {
    auto s = spec(2, 1, 4, OIIO::TypeUInt8);
    s.attribute("oiio:UnassociatedAlpha", 1);
    store(path(name), s, std::vector<unsigned char>{200, 100, 50, 128, 10, 20, 30, 0});
    const ImageFile file = read_image(path(name));
    ASSERT_FALSE(file.alpha.empty());
    EXPECT_EQ(file.alpha.at(0, 0), 128);
    EXPECT_EQ(file.alpha.at(1, 0), 0);
    EXPECT_NEAR(file.rgb.pixel(0, 0)[0], srgb(200 / 255.0), 1e-6) << name;
    EXPECT_NEAR(file.rgb.pixel(1, 0)[2], srgb(30 / 255.0), 1e-6) << name;
  }
}

TEST_F(ReadImage, ColoursStoredTimesAlphaAreDivided) {
  store(path("a.exr"), spec(3, 1, 4, OIIO::TypeFloat),
        std::vector<float>{0.5f, 0.25f, 1, 0.5f, 3, 2, 1, 1, 0.125f, 0.25f, 0.5f, 0});
  const ImageFile file = read_image(path("a.exr"));
  EXPECT_THAT(file.rgb.data(), ::testing::ElementsAre(1, 0.5f, 2, 3, 2, 1, 0.125f, 0.25f, 0.5f));
  EXPECT_THAT(file.alpha.data(), ::testing::ElementsAre(128, 255, 0));
}

TEST_F(ReadImage, ColourIsFoundAmongManyChannels) {
  auto s = spec(1, 1, 5, OIIO::TypeFloat);
  s.channelnames = {"Depth.Z", "View.B", "View.G", "View.R", "View.X"};
  store(path("a.exr"), s, std::vector<float>{9, 3, 2, 1, 7});
  EXPECT_THAT(read_image(path("a.exr")).rgb.data(), ::testing::ElementsAre(1, 2, 3));
}

TEST_F(ReadImage, OrientationTagIsIgnored) {
  auto s = spec(16, 8, 3, OIIO::TypeUInt8);
  s.attribute("Orientation", 6);  // "turn right to see it"
  store(path("a.jpg"), s, std::vector<unsigned char>(16 * 8 * 3, 128));
  const ImageFile file = read_image(path("a.jpg"));
  EXPECT_EQ(file.rgb.width(), 16);
  EXPECT_EQ(file.rgb.height(), 8);
  EXPECT_EQ(image_size(path("a.jpg")).width, 16);
}

TEST_F(ReadImage, PixelsThatAreNotFiniteAreCountedAndMasked) {
  const float nan = std::nanf(""), inf = std::numeric_limits<float>::infinity();
  store(path("a.exr"), spec(4, 1, 3, OIIO::TypeFloat),
        std::vector<float>{1, 2, 3, 1, nan, 3, 4, 5, 6, 7, 8, -inf});
  const ImageFile file = read_image(path("a.exr"));
  EXPECT_EQ(file.invalid_pixels, 2);
  EXPECT_THAT(file.valid.data(), ::testing::ElementsAre(255, 0, 255, 0));
  EXPECT_THAT(file.rgb.data(), ::testing::ElementsAre(1, 2, 3, 0, 0, 0, 4, 5, 6, 0, 0, 0));
}

TEST_F(ReadImage, SizeComesFromTheHeader) {
  store(path("a.hdr"), spec(37, 21, 3, OIIO::TypeFloat), std::vector<float>(37 * 21 * 3, 1));
  EXPECT_EQ(image_size(path("a.hdr")).width, 37);
  EXPECT_EQ(image_size(path("a.hdr")).height, 21);
}

TEST_F(ReadImage, NamesNeedNotBeUtf8) {
  const std::string name = path("caf\xe9.png");
  store(path("a.png"), spec(2, 2, 3, OIIO::TypeUInt8), std::vector<unsigned char>(12, 255));
  fs::rename(path("a.png"), name);
  EXPECT_EQ(read_image(name).rgb.pixel(1, 1)[0], 1.0f);
}

// --- files that are wrong

/// Expects read_image, read_mask and read_exr_channels to refuse the file, and nothing on stderr.
void expect_refused(const std::string& path, const std::string& found) {
  SCOPED_TRACE(path);
  ::testing::internal::CaptureStderr();
  const auto message = ThrowsMessage<InvalidInput>(AllOf(HasSubstr(path + ": found"), HasSubstr(found)));
  EXPECT_THAT([&] { read_image(path); }, message);
  EXPECT_THAT([&] { read_mask(path); }, message);
  EXPECT_THAT([&] { read_exr_channels(path); }, message);
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

TEST_F(BadImage, MissingFile) {
  expect_refused(path("none.png"), "no such file");
  EXPECT_THROW(image_size(path("none.png")), InvalidInput);
}

TEST_F(BadImage, Folder) {
  fs::create_directory(path("a.png"));
  expect_refused(path("a.png"), "a folder");
  EXPECT_THROW(image_size(path("a.png")), InvalidInput);
}

TEST_F(BadImage, ZeroBytes) {
  for (const char* name : {"a.png", "a.jpg", "a.tif", "a.exr", "a.hdr"}) {
    put_bytes(path(name), "");
    expect_refused(path(name), "0 bytes");
  }
}

TEST_F(BadImage, NoImageAtAll) {
  for (const char* name : {"a.png", "a.jpg", "a.tif", "a.exr", "a.hdr", "a.txt", "noname"}) {
    put_bytes(path(name), "This is a text file that somebody renamed.\n");
    expect_refused(path(name), "no image that can be read");
    EXPECT_THROW(image_size(path(name)), InvalidInput) << name;
    EXPECT_THAT([&] { read_image(path(name)); },
                ThrowsMessage<InvalidInput>(::testing::Not(HasSubstr("no reason given"))));
  }
}

TEST_F(BadImage, TruncatedAtAnyPlace) {
  std::vector<unsigned char> values(96 * 64 * 3);
  unsigned state = 1;
  for (auto& v : values) v = static_cast<unsigned char>((state = state * 1664525u + 1013904223u) >> 24);
  std::vector<float> floats(values.begin(), values.end());
  for (const char* name : {"a.png", "a.jpg", "a.tif"})
    store(path(name), spec(96, 64, 3, OIIO::TypeUInt8), values);
  for (const char* name : {"a.exr", "a.hdr"}) store(path(name), spec(96, 64, 3, OIIO::TypeFloat), floats);
  for (const char* name : {"a.png", "a.jpg", "a.tif", "a.exr", "a.hdr"}) {
    const std::string whole = bytes_of(path(name));
    for (const double share : {0.02, 0.3, 0.5, 0.9, 0.99}) {
      SCOPED_TRACE(share);
      const std::string cut = path("cut_" + std::to_string(share) + name);
      put_bytes(cut, whole.substr(0, static_cast<std::size_t>(share * whole.size())));
      expect_refused(cut, "");
    }
    EXPECT_NO_THROW(read_image(path(name)));
  }
}

TEST_F(BadImage, PngWithOneFlippedByte) {
  store(path("a.png"), spec(64, 64, 3, OIIO::TypeUInt8), ramp<unsigned char>(64 * 64 * 3, 7));
  std::string bytes = bytes_of(path("a.png"));
  bytes[bytes.size() / 2] ^= 0x10;
  put_bytes(path("b.png"), bytes);
  expect_refused(path("b.png"), "wrong checksum");
}

TEST_F(BadImage, AllNaN) {
  store(path("a.exr"), spec(2, 2, 3, OIIO::TypeFloat), std::vector<float>(12, std::nanf("")));
  EXPECT_THAT([&] { read_image(path("a.exr")); },
              ThrowsMessage<InvalidInput>(HasSubstr("NaN or infinity in every")));
}

TEST_F(BadImage, DataWindowSmallerThanThePicture) {
  auto s = spec(4, 4, 3, OIIO::TypeFloat);
  s.full_width = 8;
  s.full_height = 6;
  store(path("a.exr"), s, std::vector<float>(48, 1));
  expect_refused(path("a.exr"), "a data window of 4 x 4");
}

// --- masks

TEST_F(ReadMask, GreyIsTakenAsStored) {
  store(path("a.png"), spec(4, 1, 1, OIIO::TypeUInt8), std::vector<unsigned char>{0, 1, 100, 255});
  EXPECT_THAT(read_mask(path("a.png")).data(), ::testing::ElementsAre(0, 1, 100, 255));
  store(path("a.tif"), spec(2, 1, 1, OIIO::TypeUInt16), std::vector<unsigned short>{25700, 65535});
  EXPECT_THAT(read_mask(path("a.tif")).data(), ::testing::ElementsAre(100, 255));
  store(path("a.exr"), spec(3, 1, 1, OIIO::TypeFloat), std::vector<float>{0.5f, 7, std::nanf("")});
  EXPECT_THAT(read_mask(path("a.exr")).data(), ::testing::ElementsAre(128, 255, 0));
}

TEST_F(ReadMask, LargestOfColours) {
  store(path("a.png"), spec(2, 1, 3, OIIO::TypeUInt8), std::vector<unsigned char>{0, 200, 10, 255, 0, 0});
  EXPECT_THAT(read_mask(path("a.png")).data(), ::testing::ElementsAre(200, 255));
}

TEST_F(ReadMask, AlphaUnlessItSaysNothing) {
  auto s = spec(2, 1, 4, OIIO::TypeUInt8);
  s.attribute("oiio:UnassociatedAlpha", 1);
  store(path("a.png"), s, std::vector<unsigned char>{9, 9, 9, 128, 9, 9, 9, 0});
  EXPECT_THAT(read_mask(path("a.png")).data(), ::testing::ElementsAre(128, 0));
  store(path("b.png"), s, std::vector<unsigned char>{9, 9, 9, 255, 0, 0, 0, 255});
  EXPECT_THAT(read_mask(path("b.png")).data(), ::testing::ElementsAre(9, 0));
}

TEST_F(ReadMask, ZeroAndOneMeanNoAndYes) {
  store(path("a.png"), spec(3, 1, 1, OIIO::TypeUInt8), std::vector<unsigned char>{0, 1, 1});
  EXPECT_THAT(read_mask(path("a.png")).data(), ::testing::ElementsAre(0, 255, 255));
}

// --- writing

TEST_F(WritePng, RoundTripsThroughItsResponse) {
  Image image(16, 16, 3);
  for (std::size_t i = 0; i < image.data().size(); ++i) image.data()[i] = i / 800.0f;
  for (const Response& response :
       {Response{}, Response{ResponseCurve::kLinear}, Response{ResponseCurve::kGamma, 1.8}}) {
    write_png(path("a.png"), image, response);
    const ImageFile back = read_image(path("a.png"), response);
    for (std::size_t i = 0; i < image.data().size(); ++i)
      ASSERT_NEAR(encode(response, back.rgb.data()[i]), encode(response, image.data()[i]), 0.51 / 255);
  }
}

TEST_F(WritePng, GreyAndMasksHaveOneChannel) {
  Mask mask(3, 1);
  mask.data() = {0, 77, 255};
  write_png(path("a.png"), mask);
  EXPECT_EQ(OIIO::ImageInput::open(path("a.png"))->spec().nchannels, 1);
  EXPECT_EQ(read_mask(path("a.png")).data(), mask.data());
  write_png(path("b.png"), Image(3, 1, 1, 1.0f));
  EXPECT_EQ(OIIO::ImageInput::open(path("b.png"))->spec().nchannels, 1);
}

TEST_F(WritePng, ReplacesWholeFilesAndLeavesNothingElse) {
  write_png(path("a.png"), Mask(4, 4, 0));
  write_png(path("a.png"), Mask(2, 2, 255));
  EXPECT_EQ(image_size(path("a.png")).width, 2);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_.path()), fs::directory_iterator()), 1);
}

TEST_F(WritePng, SamePixelsGiveTheSameBytes) {
  write_png(path("a.png"), Image(9, 7, 3, 0.3f));
  write_png(path("b.png"), Image(9, 7, 3, 0.3f));
  EXPECT_EQ(bytes_of(path("a.png")), bytes_of(path("b.png")));
}

TEST_F(WritePng, TargetThatCannotBeWrittenIsAnIoError) {
  fs::create_directory(path("a.png"));
  fs::create_directory(path("a.png") + "/full");
  EXPECT_THROW(write_png(path("a.png"), Mask(4, 4, 0)), IoError);
  put_bytes(path("file"), "x");
  EXPECT_THROW(write_png(path("file/b.png"), Mask(4, 4, 0)), IoError);
}

TEST_F(WriteExr, ChannelsComeBackByNameBitForBit) {
  std::vector<FloatChannel> channels;
  for (const char* name : {"Z", "V", "A", "Z.bp", "V.bp"}) {
    Image plane(5, 3, 1);
    for (std::size_t i = 0; i < plane.data().size(); ++i)
      plane.data()[i] = std::sin(100.0f * channels.size() + i);
    channels.push_back({name, plane});
  }
  channels[0].plane.data()[4] = std::numeric_limits<float>::infinity();
  write_exr(path("a.exr"), channels);
  const auto back = read_exr_channels(path("a.exr"));
  ASSERT_EQ(back.size(), 5);
  for (const FloatChannel& channel : channels) {
    const Image* plane = find_channel(back, channel.name);
    ASSERT_TRUE(plane) << channel.name;
    EXPECT_EQ(plane->width(), 5);
    EXPECT_EQ(plane->data(), channel.plane.data()) << channel.name;
  }
  EXPECT_EQ(find_channel(back, "bp"), nullptr);
}

TEST_F(WriteExr, HalfKeepsElevenBitsAndHoldsWhatIsTooBright) {
  Image rgb(2, 1, 3);
  const std::vector<float> values = {0.1f, 1.0f / 3, 5, 46000, 1e6f, -1e6f};
  rgb.data() = values;
  write_exr(path("half.exr"), rgb_channels(rgb), ExrPrecision::kHalf);
  const auto back = read_exr_channels(path("half.exr"));
  ASSERT_EQ(back.size(), 3);
  for (int i = 0; i < 6; ++i) {
    const Image* plane = find_channel(back, std::string(1, "RGB"[i % 3]));
    ASSERT_TRUE(plane);
    const float expected = std::clamp(values[i], -65504.0f, 65504.0f);
    EXPECT_NEAR(plane->data()[i / 3] / expected, 1, 0.0005) << i;
  }
  EXPECT_NE(find_channel(back, "G")->data()[0], values[1]);
}

TEST_F(WriteExr, SamePixelsGiveTheSameBytes) {
  write_exr(path("a.exr"), {{"Z", Image(9, 7, 1, 0.3f)}});
  write_exr(path("b.exr"), {{"Z", Image(9, 7, 1, 0.3f)}});
  EXPECT_EQ(bytes_of(path("a.exr")), bytes_of(path("b.exr")));
}

TEST_F(WriteExr, ChannelsMustFitTogether) {
  EXPECT_THROW(write_exr(path("a.exr"), {}), std::logic_error);
  EXPECT_THROW(write_exr(path("a.exr"), {{"Z", Image(2, 2, 1)}, {"V", Image(3, 2, 1)}}), std::logic_error);
  EXPECT_THROW(write_exr(path("a.exr"), {{"Z", Image(2, 2, 1)}, {"Z", Image(2, 2, 1)}}), std::logic_error);
  EXPECT_THROW(write_exr(path("a.exr"), {{"Z", Image(2, 2, 3)}}), std::logic_error);
}

TEST_F(ReadImage, ManyThreadsAtOnce) {
  for (int i = 0; i < 4; ++i)
    write_png(path(std::to_string(i) + ".png"), Image(64, 64, 3, 0.2f * i), Response{ResponseCurve::kLinear});
  std::vector<std::thread> threads;
  std::array<int, 4> good{};
  for (int i = 0; i < 4; ++i)
    threads.emplace_back([&, i] {
      for (int k = 0; k < 20; ++k)
        good[i] += std::abs(read_image(path(std::to_string(i) + ".png"), Response{ResponseCurve::kLinear})
                                .rgb.data()[99] -
                            0.2f * i) < 1e-6f;
    });
  for (auto& thread : threads) thread.join();
  EXPECT_THAT(good, ::testing::Each(20));
}

// --- real data

TEST_F(ReadImage, TrueDepthHasOneChannelWhateverItsName) {
  ROXEL_TEST_DATA_OR_SKIP(folder, "plane/depth");
  const auto channels = read_exr_channels(fs::directory_iterator(folder)->path().string());
  ASSERT_EQ(channels.size(), 1);
  EXPECT_EQ(channels[0].plane.width(), 400);
  EXPECT_THAT(channels[0].plane.data(), ::testing::Contains(::testing::Gt(1.0f)));
}

TEST_F(ReadImage, RadianceOfTheSunIsKept) {
  ROXEL_TEST_DATA_OR_SKIP(folder, "courtyard/images");
  float brightest = 0;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const ImageFile file = read_image(entry.path().string());
    ASSERT_TRUE(file.valid.empty()) << entry.path();
    for (const float value : file.rgb.data()) brightest = std::max(brightest, value);
  }
  EXPECT_GT(brightest, 1e4f);
}

}  // namespace
}  // namespace roxel
