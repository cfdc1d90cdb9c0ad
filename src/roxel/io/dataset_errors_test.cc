// What is wrong with a data set gets one clear error: each row breaks a good set in one way and says what the
// message must contain (file, line or field; what was found; what was expected).

#include <gmock/gmock.h>

#include <functional>

#include "roxel/base/error.h"
#include "roxel/io/dataset_fixture.h"
#include "roxel/io/dataset_reader.h"

namespace roxel {
namespace {

using namespace fixture;
using ::testing::HasSubstr;

enum class Base { kEmpty, kColmapText, kColmapBinary, kTransforms, kMiddlebury, kStrecha, kKrt };

struct BadSet {
  const char* name;
  Base base;
  std::function<void(const fs::path& set)> spoil;
  std::vector<std::string> message;
  ReadOptions options = {};
};

void PrintTo(const BadSet& bad, std::ostream* out) { *out << bad.name; }

void write_base(Base base, const fs::path& set) {
  const std::vector<TextbookCamera> cameras = textbook_cameras(3);
  switch (base) {
    case Base::kEmpty:
      break;
    case Base::kColmapText:
      write_colmap_text(set, cameras);
      break;
    case Base::kColmapBinary:
      write_colmap_binary(set, cameras);
      break;
    case Base::kTransforms:
      write_transforms_json(set, cameras, "\"near\": 1, \"far\": 2,\n");
      break;
    case Base::kMiddlebury:
      write_middlebury(set, cameras);
      break;
    case Base::kStrecha:
      write_strecha(set, cameras);
      break;
    case Base::kKrt:
      write_krt(set, cameras);
      break;
  }
}

using Spoil = std::function<void(const fs::path&)>;

Spoil replace(const std::string& file, const std::string& from, const std::string& to) {
  return [=](const fs::path& set) { replace_in_file(set / file, from, to); };
}

Spoil write(const std::string& file, const std::string& content) {
  return [=](const fs::path& set) { write_file(set / file, content); };
}

Spoil remove(const std::string& file) {
  return [=](const fs::path& set) { ASSERT_TRUE(fs::remove(set / file)); };
}

Spoil cut(const std::string& file, double share) {
  return [=](const fs::path& set) {
    const std::string content = read_file(set / file);
    write_file(set / file, content.substr(0, static_cast<std::size_t>(share * content.size())));
  };
}

Spoil resize(const std::string& image, int width, int height) {
  return [=](const fs::path& set) { write_image(set / image, width, height); };
}

/// Overwrites bytes of a binary file.
template <class T>
Spoil poke(const std::string& file, std::size_t at, T value) {
  return [=](const fs::path& set) {
    std::string content = read_file(set / file);
    content.replace(at, sizeof value, reinterpret_cast<const char*>(&value), sizeof value);
    write_file(set / file, content);
  };
}

/// Replaces the fields of a line of a text file (0-based field, from the first line that has enough).
Spoil set_field(const std::string& file, int line_number, std::size_t field, const std::string& value) {
  return [=](const fs::path& set) {
    std::istringstream in(read_file(set / file));
    std::string out, line;
    for (int number = 1; std::getline(in, line); ++number) {
      if (number == line_number) {
        std::istringstream words(line);
        std::string word, rebuilt;
        for (std::size_t i = 0; words >> word; ++i) rebuilt += (i ? " " : "") + (i == field ? value : word);
        line = rebuilt;
      }
      out += line + "\n";
    }
    write_file(set / file, out);
  };
}

ReadOptions with_format(const std::string& format) {
  ReadOptions options;
  options.format = format;
  return options;
}

ReadOptions with_nodes(const std::string& nodes) {
  ReadOptions options;
  options.nodes = nodes;
  return options;
}

ReadOptions with_images(const std::string& images) {
  ReadOptions options;
  options.images = images;
  return options;
}

ReadOptions with_masks(const std::string& masks) {
  ReadOptions options;
  options.masks = masks;
  return options;
}

const Spoil kNothing = [](const fs::path&) {};
const char* const kCameras = "sparse/0/cameras.txt";
const char* const kImages = "sparse/0/images.txt";
const char* const kPoints = "sparse/0/points3D.txt";

// clang-format off
const BadSet kBadSets[] = {
    // What is there at all.
    {"EmptyFolder", Base::kEmpty, kNothing, {"an empty folder", "transforms.json"}},
    {"NoSuchFolder", Base::kEmpty, [](const fs::path& set) { fs::remove(set); }, {"no such file or folder"}},
    {"NothingKnown", Base::kEmpty, write("readme.md", "hello"), {"1 entry (readme.md)", "*_par.txt"}},
    {"UnknownFormat", Base::kColmapText, kNothing, {"format", "'bundler'", "colmap"}, with_format("bundler")},
    {"ColmapAskedForButTransforms", Base::kTransforms, kNothing, {"transforms files in", "transforms.json", "format colmap was asked for"}, with_format("colmap")},
    {"TwoFormats", Base::kMiddlebury, [](const fs::path& set) { write_strecha(set, textbook_cameras(3)); }, {"files of the formats middlebury and strecha", "--format"}},
    {"TwoFormatsBesideTransforms", Base::kTransforms, [](const fs::path& set) { write_colmap_text(set, textbook_cameras(3)), write_middlebury(set, textbook_cameras(3)); }, {"transforms and colmap and middlebury", "--format"}},
    {"TransformsAskedForButColmap", Base::kColmapText, kNothing, {"colmap files in", "format transforms was asked for"}, with_format("transforms")},
    {"NodesOutOfRange", Base::kColmapText, kNothing, {"nodes", "'7:9'", "3 nodes"}, with_nodes("7:9")},
    {"NodesNotARange", Base::kColmapText, kNothing, {"nodes", "'seven'", "A:B"}, with_nodes("seven")},
    {"NoImageMatches", Base::kColmapText, kNothing, {"images", "'x*'"}, with_images("x*")},
    {"MasksNowhere", Base::kColmapText, kNothing, {"masks", "'/nowhere'", "a folder"}, with_masks("/nowhere")},
    // Images.
    {"MissingImage", Base::kColmapText, remove("images/viewb.png"), {"images/viewb.png", "images.txt:4", "no such file"}},
    {"EmptyImage", Base::kColmapText, write("images/viewb.png", ""), {"images/viewb.png", "0 bytes"}},
    {"TruncatedImage", Base::kColmapText, cut("images/viewb.png", 0.7), {"images/viewb.png", "truncated"}},
    {"NotAnImage", Base::kColmapText, write("images/viewb.png", "hello"), {"images/viewb.png", "cannot be read as an image"}},
    {"ImageOfOtherSize", Base::kColmapText, resize("images/viewb.png", 30, 24), {"images/viewb.png", "30 x 24", "32 x 24", "images.txt:4"}},
    {"MaskOfOtherSize", Base::kColmapText, resize("masks/viewb.png", 32, 20), {"masks/viewb.png", "32 x 20", "32 x 24"}},
    {"DuplicateImage", Base::kColmapText, replace(kImages, "viewb.png", "viewa.png"), {"images.txt:4", "'viewa' for the second time", "images.txt:2"}},
    // COLMAP text.
    {"NoImagesFile", Base::kColmapText, remove(kImages), {"images.txt", "no such file"}},
    {"NoCamerasFile", Base::kColmapText, remove(kCameras), {"cameras.txt", "no such file"}},
    {"EmptyCamerasFile", Base::kColmapText, write(kCameras, ""), {"cameras.txt", "0 bytes"}},
    {"OnlyComments", Base::kColmapText, write(kImages, "# nothing\n"), {"images.txt", "no images"}},
    {"CameraIdDoesNotExist", Base::kColmapText, set_field(kImages, 4, 8, "77"), {"images.txt:4: CAMERA_ID", "found 77", "it has 1 2 3"}},
    {"UnknownCameraModel", Base::kColmapText, replace(kCameras, "PINHOLE", "PINHOLE_X"), {"cameras.txt:2: camera model", "'PINHOLE_X'", "SIMPLE_RADIAL"}},
    {"TooFewParameters", Base::kColmapText, replace(kCameras, "PINHOLE", "OPENCV"), {"cameras.txt:2: parameters of OPENCV", "found 4", "expected 8"}},
    {"DuplicateCamera", Base::kColmapText, set_field(kCameras, 3, 0, "1"), {"cameras.txt:3: CAMERA_ID", "1 for the second time"}},
    {"ZeroFocalLength", Base::kColmapText, set_field(kCameras, 3, 4, "0"), {"cameras.txt:3", "0", "focal"}},
    {"NanFocalLength", Base::kColmapText, set_field(kCameras, 3, 4, "nan"), {"cameras.txt:3", "'nan'", "a finite number"}},
    {"NegativeWidth", Base::kColmapText, set_field(kCameras, 3, 2, "-32"), {"cameras.txt:3", "-32"}},
    {"ZeroQuaternion", Base::kColmapText, [](const fs::path& set) { for (std::size_t f = 1; f < 5; ++f) set_field(kImages, 4, f, "0")(set); }, {"images.txt:4", "quaternion 0 0 0 0", "length 0"}},
    {"QuaternionTooLong", Base::kColmapText, set_field(kImages, 4, 1, "1.7"), {"images.txt:4", "1.7", "unit quaternion"}},
    {"NanTranslation", Base::kColmapText, set_field(kImages, 4, 6, "NaN"), {"images.txt:4: TX TY TZ", "'NaN'"}},
    {"InfiniteTranslation", Base::kColmapText, set_field(kImages, 4, 6, "inf"), {"images.txt:4: TX TY TZ", "'inf'"}},
    {"ShortImageLine", Base::kColmapText, replace(kImages, " viewb.png", ""), {"images.txt:4", "9 fields", "10: IMAGE_ID"}},
    {"NoLineForPoints", Base::kColmapText, replace(kImages, "viewa.png\n\n", "viewa.png\n"), {"images.txt:3", "10 fields", "triples"}},
    {"NanPoint", Base::kColmapText, set_field(kPoints, 5, 2, "nan"), {"points3D.txt:5: X Y Z", "'nan'"}},
    {"JsonInCamerasFile", Base::kColmapText, write(kCameras, "{\"frames\": []}"), {"cameras.txt", "JSON", "COLMAP's text"}},
    {"BinaryInTextFile", Base::kColmapText, write(kCameras, std::string("\1\0\0\0\0\0\0\0", 8)), {"cameras.txt", "binary data", "COLMAP's text"}},
    {"NonUtf8Name", Base::kColmapText, replace(kImages, "viewb", "vi\xe9w"), {"images.txt:4: NAME", "vi\\xe9w", "UTF-8"}},
    // COLMAP binary.
    {"TextInBinaryFile", Base::kColmapBinary, write("sparse/0/cameras.bin", "1 PINHOLE 32 24 40 40 16 12\n"), {"cameras.bin", "text", "binary format"}},
    {"TruncatedCameras", Base::kColmapBinary, cut("sparse/0/cameras.bin", 0.8), {"cameras.bin", "truncated"}},
    {"TruncatedImages", Base::kColmapBinary, cut("sparse/0/images.bin", 0.9), {"images.bin", "image 3 of 3", "truncated"}},
    {"TruncatedPoints", Base::kColmapBinary, cut("sparse/0/points3D.bin", 0.99), {"points3D.bin", "truncated"}},
    {"CountFarTooLarge", Base::kColmapBinary, poke<std::uint64_t>("sparse/0/images.bin", 0, 1ull << 60), {"images.bin: number of images", "truncated", "1152921504606846976 records"}},
    {"BytesTooMany", Base::kColmapBinary, [](const fs::path& set) { std::ofstream(set / "sparse/0/cameras.bin", std::ios::app) << "xx"; }, {"cameras.bin", "2 bytes after the last record"}},
    {"EmptyBinary", Base::kColmapBinary, write("sparse/0/images.bin", ""), {"images.bin", "0 bytes"}},
    {"UnknownModelId", Base::kColmapBinary, poke<std::int32_t>("sparse/0/cameras.bin", 12, 99), {"cameras.bin: camera 1 of 3: camera model", "id 99"}},
    {"NanInBinary", Base::kColmapBinary, poke("sparse/0/cameras.bin", 32, std::numeric_limits<double>::quiet_NaN()), {"cameras.bin: camera 1 of 3: parameters", "nan"}},
    {"ZeroFocalInBinary", Base::kColmapBinary, poke("sparse/0/cameras.bin", 32, 0.0), {"cameras.bin: camera 1 of 3", "focal"}},
    {"CameraIdInBinary", Base::kColmapBinary, poke<std::int32_t>("sparse/0/images.bin", 8 + 4 + 56, 42), {"images.bin: image 1 of 3: CAMERA_ID", "found 42"}},
    {"ZeroQuaternionInBinary", Base::kColmapBinary, [](const fs::path& set) { for (std::size_t i = 0; i < 4; ++i) poke("sparse/0/images.bin", 12 + 8 * i, 0.0)(set); }, {"images.bin: image 1 of 3", "quaternion 0 0 0 0"}},
    {"NoImagesBinary", Base::kColmapBinary, remove("sparse/0/images.bin"), {"images.bin", "no such file"}},
    // transforms.json.
    {"EmptyJson", Base::kTransforms, write("transforms.json", ""), {"transforms.json", "0 bytes"}},
    {"TextForJson", Base::kTransforms, write("transforms.json", "1 PINHOLE 32 24\n"), {"transforms.json", "text", "JSON"}},
    {"TruncatedJson", Base::kTransforms, cut("transforms.json", 0.6), {"transforms.json:", "the end of the file", "valid JSON"}},
    {"BrokenJson", Base::kTransforms, replace("transforms.json", "\"w\": 32", "\"w\": 32 32"), {"transforms.json:4: w", "'32'", "valid JSON"}},
    {"NanInMatrix", Base::kTransforms, replace("transforms.json", "1]]}", "NaN]]}"), {"transforms.json:5: transform_matrix", "'NaN'", "a finite number"}},
    {"NoFrames", Base::kTransforms, write("transforms.json", "{\"frames\": []}"), {"transforms.json: frames", "[]", "at least one"}},
    {"FramesMissing", Base::kTransforms, write("transforms.json", "{\"w\": 3}"), {"transforms.json: frames", "nothing"}},
    {"JsonList", Base::kTransforms, write("transforms.json", "[1, 2]"), {"transforms.json: frames", "nothing"}},
    {"NoMatrix", Base::kTransforms, replace("transforms.json", "transform_matrix", "matrix"), {"frames[0].transform_matrix", "nothing"}},
    {"MatrixOfThree", Base::kTransforms, replace("transforms.json", "\"transform_matrix\": [[", "\"transform_matrix\": [[1,"), {"frames[0].transform_matrix", "4 x 4"}},
    {"Reflection", Base::kTransforms, [](const fs::path& set) {
       write_file(set / "transforms.json", "{\"fl_x\": 40, \"frames\": [{\"file_path\": \"images/viewa.png\", \"transform_matrix\": [[1,0,0,0],[0,1,0,0],[0,0,-1,0],[0,0,0,1]]}]}");
     }, {"frames[0].transform_matrix", "[1 0 0; 0 1 0; 0 0 -1]", "determinant -1", "determinant +1"}},
    {"ScaledMatrix", Base::kTransforms, [](const fs::path& set) {
       write_file(set / "transforms.json", "{\"fl_x\": 40, \"frames\": [{\"file_path\": \"images/viewa.png\", \"transform_matrix\": [[2,0,0,0],[0,2,0,0],[0,0,2,0],[0,0,0,1]]}]}");
     }, {"frames[0].transform_matrix", "[2 0 0; 0 2 0; 0 0 2]", "miss orthonormality by 3", "0.001"}},
    {"NoFocalLength", Base::kTransforms, replace("transforms.json", "\"fl_x\"", "\"focal\""), {"frames[0]", "neither fl_x nor camera_angle_x"}},
    {"ZeroFocalInJson", Base::kTransforms, replace("transforms.json", "\"fl_x\": 40", "\"fl_x\": 0"), {"frames[0].fl_x", "0.000", "above 0"}},
    {"StringForNumber", Base::kTransforms, replace("transforms.json", "\"fl_x\": 40", "\"fl_x\": \"40\""), {"frames[0].fl_x", "\"40\"", "a finite number"}},
    {"NearBeyondFar", Base::kTransforms, replace("transforms.json", "\"near\": 1", "\"near\": 2.5"), {"frames[0].far", "found 2", "more than near, 2.5"}},
    {"NegativeNear", Base::kTransforms, replace("transforms.json", "\"near\": 1", "\"near\": -1"), {"frames[0].near", "-1", "more than 0"}},
    {"LatitudeOutOfRange", Base::kTransforms, replace("transforms.json", "\"near\": 1", "\"latitude\": 91"), {"frames[0].latitude", "91", "-90 to 90"}},
    {"LatitudeOfAllOutOfRange", Base::kTransforms, replace("transforms.json", "{", "{\"lat\": 91,"), {"transforms.json: lat", "91", "-90 to 90"}},
    {"LongitudeOutOfRange", Base::kTransforms, replace("transforms.json", "\"near\": 1", "\"longitude\": -200"), {"frames[0].longitude", "-200", "-180 to 180"}},
    {"TimeWithoutZone", Base::kTransforms, replace("transforms.json", "\"near\": 1", "\"time_utc\": \"2003-08-21T16:50:00\""), {"frames[0].time_utc", "'2003-08-21T16:50:00'", "zone"}},
    {"DayThatIsNone", Base::kTransforms, replace("transforms.json", "\"near\": 1", "\"time_utc\": \"2003-02-30T16:50:00Z\""), {"frames[0].time_utc", "2003-02-30"}},
    {"TimeOfANodeWithoutZone", Base::kTransforms, [](const fs::path& set) {
       replace("transforms.json", "\"near\": 1", "\"node\": 7")(set);
       replace("transforms.json", "{", "{\"nodes\": [{}, {\"node\": 7, \"time_utc\": \"2003-08-21T16:50:00\"}],")(set);
     }, {"transforms.json: nodes[1].time_utc", "'2003-08-21T16:50:00'", "zone"}},
    {"TwoEntriesOfANode", Base::kTransforms, [](const fs::path& set) {
       replace("transforms.json", "\"near\": 1", "\"node\": 7")(set);
       replace("transforms.json", "{", "{\"nodes\": [{\"node\": 7, \"time_utc\": \"2003-08-21T16:50:00Z\"}, {\"node\": 7, \"time_utc\": \"2003-08-22T16:50:00Z\"}],")(set);
     }, {"transforms.json: nodes[1]", "node 7 as nodes[0]"}},
    {"NodeNotWhole", Base::kTransforms, replace("transforms.json", "\"near\": 1", "\"node\": 1.5"), {"frames[0].node", "1.5", "a whole number"}},
    {"UnknownModelInJson", Base::kTransforms, replace("transforms.json", "\"near\": 1", "\"camera_model\": \"EQUIRECT\""), {"frames[0].camera_model", "'EQUIRECT'", "OPENCV_FISHEYE"}},
    {"PinholeWithDistortion", Base::kTransforms, replace("transforms.json", "\"near\": 1", "\"camera_model\": \"PINHOLE\", \"k1\": 0.1"), {"frames[0].k1", "0.1", "PINHOLE does not have it"}},
    {"BoundsUpsideDown", Base::kTransforms, replace("transforms.json", "{", "{\"scene_bounds\": [[0, 0, 0], [1, -1, 1]],"), {"transforms.json: scene_bounds", "[[0,0,0],[1,-1,1]]"}},
    {"MissingImageInJson", Base::kTransforms, remove("images/viewb.png"), {"images/viewb.png", "frames[1]", "no such file"}},
    {"MissingMaskInJson", Base::kTransforms, replace("transforms.json", "\"near\": 1", "\"mask_path\": \"masks/none.png\""), {"masks/none.png", "frames[0]", "no such file"}},
    {"SizeInJson", Base::kTransforms, replace("transforms.json", "\"w\": 32", "\"w\": 64"), {"viewa.png", "32 x 24", "64 x 24", "frames[0]"}},
    {"NonUtf8InJson", Base::kTransforms, replace("transforms.json", "viewb", "vi\xff" "ew"), {"transforms.json:7", "vi\\xffew", "UTF-8"}},
    {"BrokenModelBesideJson", Base::kTransforms, [](const fs::path& set) {
       write_colmap_text(set, textbook_cameras(3));
       set_field(kImages, 4, 8, "77")(set);
     }, {"images.txt:4: CAMERA_ID", "found 77", "format transforms"}},
    // The others.
    {"WrongCount", Base::kMiddlebury, replace("test_par.txt", "3\n", "4\n"), {"test_par.txt", "3 lines", "expected 4"}},
    {"MissingField", Base::kMiddlebury, replace("test_par.txt", "viewb.png ", ""), {"test_par.txt:3", "21 fields", "22"}},
    {"NotANumber", Base::kMiddlebury, set_field("test_par.txt", 3, 3, "x"), {"test_par.txt:3: K", "'x'"}},
    {"NotUpperTriangular", Base::kMiddlebury, set_field("test_par.txt", 3, 4, "7"), {"test_par.txt:3: K", "[fx skew cx; 0 fy cy; 0 0 1]"}},
    {"ZeroFocalInPar", Base::kMiddlebury, set_field("test_par.txt", 3, 1, "0"), {"test_par.txt:3: fx", "found 0", "above 0"}},
    {"NotARotation", Base::kMiddlebury, set_field("test_par.txt", 3, 10, "0.99"), {"test_par.txt:3: R", "0.99", "R R^T"}},
    {"EmptyPar", Base::kMiddlebury, write("test_par.txt", ""), {"test_par.txt", "0 bytes"}},
    {"TwoPars", Base::kMiddlebury, write("other_par.txt", "0\n"), {"other_par.txt and test_par.txt"}},
    {"MissingImageInPar", Base::kMiddlebury, remove("viewb.png"), {"viewb.png", "test_par.txt:3", "no such file"}},
    {"ShortCamera", Base::kStrecha, cut("cameras/viewb.png.camera", 0.5), {"viewb.png.camera", "numbers", "26"}},
    {"DistortedCamera", Base::kStrecha, replace("cameras/viewb.png.camera", "0 0 0\n", "0.1 0 0\n"), {"viewb.png.camera: fourth row", "0.1", "0 0 0"}},
    {"SizeInCamera", Base::kStrecha, replace("cameras/viewb.png.camera", "32 24", "32 25"), {"images/viewb.png", "32 x 24", "32 x 25"}},
    {"EmptyCamera", Base::kStrecha, write("cameras/viewb.png.camera", ""), {"viewb.png.camera", "0 bytes"}},
    {"NonUtf8Camera", Base::kStrecha, [](const fs::path& set) { write_file(set / "cameras/\xe9.png.camera", "x"); }, {"cameras", "\\xe9.png.camera", "UTF-8"}},
    {"ShortKrt", Base::kKrt, cut("cameras/viewb.txt", 0.7), {"viewb.txt", "numbers", "21"}},
    {"NanInKrt", Base::kKrt, replace("cameras/viewb.txt", "\n", "\nnan "), {"viewb.txt:2", "'nan'"}},
    {"KrtWithoutImage", Base::kKrt, remove("images/viewb.png"), {"viewb.txt", "no image named viewb"}},
};
// clang-format on

class BadDataset : public ::testing::TestWithParam<BadSet> {};

TEST_P(BadDataset, GetsOneClearError) {
  const TempFolder set;
  write_base(GetParam().base, set.path());
  GetParam().spoil(set.path());
  try {
    read_dataset(set.path(), GetParam().options);
    FAIL() << "no error";
  } catch (const InvalidInput& error) {
    const std::string message = error.what();
    for (const std::string& part : GetParam().message) EXPECT_THAT(message, HasSubstr(part));
    EXPECT_THAT(message, HasSubstr("found "));
    EXPECT_THAT(message, HasSubstr("expected "));
    EXPECT_LT(message.size(), 1000u) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  }
}

INSTANTIATE_TEST_SUITE_P(DatasetReader, BadDataset, ::testing::ValuesIn(kBadSets),
                         [](const auto& test) { return std::string(test.param.name); });

TEST(DatasetReader, BaseSetsAreGoodBeforeTheyAreSpoiled) {
  for (Base base : {Base::kColmapText, Base::kColmapBinary, Base::kTransforms, Base::kMiddlebury,
                    Base::kStrecha, Base::kKrt}) {
    const TempFolder set;
    write_base(base, set.path());
    EXPECT_EQ(read_dataset(set.path()).views.size(), 3u) << static_cast<int>(base);
  }
}

}  // namespace
}  // namespace roxel
