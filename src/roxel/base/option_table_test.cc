#include "roxel/base/option_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <rapidcheck/gtest.h>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "roxel/base/error.h"
#include "roxel/base/temp_folder.h"

namespace roxel {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

enum class Update { kPosterior, kRoxels };

struct PassOptions {
  double strength = 5;
  int passes = 8;
};

struct Options {
  bool adaptive = true;
  bool interpolate = false;
  int levels = 3;
  std::uint64_t seed = 1;
  double voxel_size = 0.25;
  float floor = 0.5f;
  std::string response = "srgb";
  std::optional<double> near;
  std::optional<double> far;
  std::optional<int> limit;
  std::optional<bool> surround;
  Update update = Update::kPosterior;
  std::array<double, 3> point{1, 2, 3};
  std::optional<std::array<double, 6>> bounds;
  PassOptions pass;
};

OptionTable<Options> make_table() {
  OptionTable<PassOptions> pass;
  pass.group("Passes");
  pass.add("strength", &PassOptions::strength)
      .help("Prior strength")
      .at_least(0)
      .source("equations, section 4");
  pass.add("passes", &PassOptions::passes).help("Limit per level").range(1, 100);
  pass.rule([](const PassOptions& p) {
    return p.strength > p.passes ? std::string("strength must not be above passes") : std::string();
  });

  OptionTable<Options> table;
  table.group("Volume");
  table.add("adaptive", &Options::adaptive).help("Sample where there is detail");
  table.add("interpolate", &Options::interpolate).help("Interpolate between voxels");
  table.add("levels", &Options::levels).help("Levels").range(1, 10);
  table.add("seed", &Options::seed).help("Seed");
  table.add("voxel-size", &Options::voxel_size).help("Finest edge").unit("world units").above(0);
  table.add("floor", &Options::floor).help("Floor").at_least(0).below(1);
  table.group("Images");
  table.add("response", &Options::response)
      .help("Response")
      .check("srgb, linear or gamma:G", [](const auto& v) {
        const auto& text = std::get<std::string>(v);
        return text == "srgb" || text == "linear" || text.starts_with("gamma:");
      });
  table.add("near", &Options::near).help("Nearest").above(0).unset("from the cameras");
  table.add("far", &Options::far).help("Farthest").above(0);
  table.add("limit", &Options::limit).help("Limit");
  table.add("surround", &Options::surround).help("Surround");
  table.add("update", &Options::update, {{"posterior", Update::kPosterior}, {"roxels", Update::kRoxels}})
      .help("Update rule");
  table.add("point", &Options::point).help("Point").range(-10, 10);
  table.add("bounds", &Options::bounds).help("Box").placeholder("X0,Y0,Z0,X1,Y1,Z1");
  table.include(pass, &Options::pass);
  table.rule([](const Options& o) {
    return o.near && o.far && *o.near >= *o.far ? std::string("near must be below far") : std::string();
  });
  return table;
}

const OptionTable<Options> kTable = make_table();

/// Runs `action` and returns the message of the InvalidInput that it must throw.
template <class Action>
std::string rejection(Action action) {
  try {
    action();
  } catch (const InvalidInput& error) {
    return error.what();
  }
  return "(accepted)";
}

struct Accepted {
  std::string name, text;
  json value;            // what to_json then holds
  std::string key = "";  // under which name, where it differs
};

TEST(OptionTable, SetsFieldsFromText) {
  const std::vector<Accepted> cases = {
      {"adaptive", "false", false},
      {"adaptive", "off", false},
      {"no-adaptive", "", false, "adaptive"},
      {"no-adaptive", "true", false, "adaptive"},
      {"no-adaptive", "false", true, "adaptive"},
      {"interpolate", "", true},
      {"interpolate", "1", true},
      {"no-interpolate", "", false, "interpolate"},
      {"levels", "1", 1},
      {"levels", "10", 10},
      {"levels", "+4", 4},
      {"seed", "9223372036854775807", 9223372036854775807},
      {"voxel-size", "1e-3", 1e-3},
      {"voxel-size", ".5", 0.5},
      {"floor", "0", 0.0},
      {"response", "gamma:2.2", "gamma:2.2"},
      {"near", "2", 2.0},
      {"near", "auto", nullptr},
      {"limit", "7", 7},
      {"surround", "on", true},
      {"surround", "auto", nullptr},
      {"update", "roxels", "roxels"},
      {"point", "-10,0,10", {-10.0, 0.0, 10.0}},
      {"point", " 1 , 2,3 ", {1.0, 2.0, 3.0}},
      {"bounds", "-1,-1,-1,1,1,1.5", {-1.0, -1.0, -1.0, 1.0, 1.0, 1.5}},
      {"strength", "0", 0.0},
  };
  for (const Accepted& c : cases) {
    SCOPED_TRACE(c.name + " = \"" + c.text + "\"");
    Options options;
    ASSERT_NO_THROW(kTable.set(options, c.name, c.text));
    EXPECT_EQ(kTable.to_json(options)[c.key.empty() ? c.name : c.key], c.value);
  }
}

TEST(OptionTable, ReachesTheMembers) {
  Options options;
  kTable.set(options, "no-adaptive", "");
  kTable.set(options, "update", "roxels");
  kTable.set(options, "bounds", "0,1,2,3,4,5");
  kTable.set(options, "passes", "12");
  EXPECT_FALSE(options.adaptive);
  EXPECT_EQ(options.update, Update::kRoxels);
  EXPECT_EQ(options.bounds, (std::array<double, 6>{0, 1, 2, 3, 4, 5}));
  EXPECT_EQ(options.pass.passes, 12);
}

struct Rejected {
  std::string name, text, expected;
};

TEST(OptionTable, RejectsTextAndNamesFieldValueAndRange) {
  const std::vector<Rejected> cases = {
      {"adaptive", "maybe", "true or false"},
      {"levels", "0", "a whole number in [1, 10]"},
      {"levels", "11", "a whole number in [1, 10]"},
      {"levels", "3.5", "a whole number in [1, 10]"},
      {"levels", "3x", "a whole number in [1, 10]"},
      {"levels", "", "a whole number in [1, 10]"},
      {"levels", "auto", "a whole number in [1, 10]"},
      {"limit", "2147483648", "a whole number"},
      {"limit", "99999999999999999999", "a whole number"},
      {"seed", "-1", "a whole number"},
      {"voxel-size", "0", "a number > 0"},
      {"voxel-size", "-1", "a number > 0"},
      {"voxel-size", "nan", "a number > 0"},
      {"voxel-size", "inf", "a number > 0"},
      {"voxel-size", "1e999", "a number > 0"},
      {"voxel-size", "0,5", "a number > 0"},
      {"voxel-size", " 1", "a number > 0"},
      {"voxel-size", "+-1", "a number > 0"},
      {"floor", "1", "a number in [0, 1)"},
      {"floor", "-0.1", "a number in [0, 1)"},
      {"response", "sRGB", "srgb, linear or gamma:G"},
      {"near", "-inf", "a number > 0"},
      {"update", "posteriour", "one of posterior, roxels"},
      {"update", "", "one of posterior, roxels"},
      {"point", "1,2", "3 numbers in [-10, 10]"},
      {"point", "1,2,3,4", "3 numbers in [-10, 10]"},
      {"point", "1,,3", "3 numbers in [-10, 10]"},
      {"point", "1,,2,3", "3 numbers in [-10, 10]"},
      {"point", "1,2,3,", "3 numbers in [-10, 10]"},
      {"point", "1,2,11", "3 numbers in [-10, 10]"},
      {"point", "1,2,nan", "3 numbers in [-10, 10]"},
      {"point", "1 2 3", "3 numbers in [-10, 10]"},
      {"bounds", "", "6 numbers"},
      {"passes", "0", "a whole number in [1, 100]"},
  };
  for (const Rejected& c : cases) {
    SCOPED_TRACE(c.name + " = \"" + c.text + "\"");
    Options options;
    const json before = kTable.to_json(options);
    EXPECT_EQ(rejection([&] { kTable.set(options, c.name, c.text); }),
              "--" + c.name + ": found \"" + c.text + "\", expected " + c.expected);
    EXPECT_EQ(kTable.to_json(options), before);
  }
}

TEST(OptionTable, SaysWhatAnUnknownNameMayHaveMeant) {
  Options options;
  const auto message = [&](const std::string& name) {
    return rejection([&] { kTable.set(options, name, "1"); });
  };
  EXPECT_EQ(message("voxel-szie"), "--voxel-szie: found an unknown option, expected perhaps voxel-size");
  EXPECT_THAT(message("voxel"), HasSubstr("perhaps voxel-size"));
  EXPECT_THAT(message("ovxel-szie"), HasSubstr("perhaps voxel-size"));
  EXPECT_THAT(message("pases"), HasSubstr("perhaps passes"));
  EXPECT_THAT(message("no-levels"), HasSubstr("unknown option"));
  EXPECT_THAT(message("qqqqqqqqqqqq"), AllOf(HasSubstr("unknown option"), Not(HasSubstr("perhaps"))));
}

TEST(OptionTable, AppliesJson) {
  Options options;
  options.near = 1;
  kTable.apply_json(options, json::parse(R"({"no-adaptive": true, "levels": 2, "voxel-size": 1, "near": null,
                                    "update": "roxels", "point": [0, 1, 2.5], "passes": 4, "far": "auto"})"),
                    "config.json");
  EXPECT_FALSE(options.adaptive);
  EXPECT_EQ(options.levels, 2);
  EXPECT_EQ(options.voxel_size, 1);
  EXPECT_FALSE(options.near);
  EXPECT_EQ(options.update, Update::kRoxels);
  EXPECT_THAT(options.point, ElementsAre(0, 1, 2.5));
  EXPECT_EQ(options.pass.passes, 4);
}

TEST(OptionTable, RejectsJsonAndLeavesTheOptionsAlone) {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {R"([1])", "config.json: found array, expected a JSON object"},
      {R"({"levels": 2, "voxelsize": 1})",
       "config.json: \"voxelsize\": found an unknown option, expected perhaps voxel-size"},
      {R"({"levels": "2"})", "config.json: \"levels\": found \"2\", expected a whole number in [1, 10]"},
      {R"({"levels": 2.5})", "config.json: \"levels\": found 2.5, expected a whole number in [1, 10]"},
      {R"({"levels": 99})", "config.json: \"levels\": found 99, expected"},
      {R"({"levels": null})", "config.json: \"levels\": found null, expected"},
      {R"({"seed": 18446744073709551615})", "\"seed\": found 18446744073709551615, expected"},
      {R"({"limit": 18446744073709551615})", "\"limit\": found 18446744073709551615, expected"},
      {R"({"levels": 2, "voxel-size": -1})", "\"voxel-size\": found -1, expected a number > 0"},
      {R"({"voxel-size": true})", "\"voxel-size\": found true, expected a number > 0"},
      {R"({"adaptive": 1})", "\"adaptive\": found 1, expected true or false"},
      {R"({"adaptive": true, "no-adaptive": true})", "found a second value of the same option"},
      {R"({"update": 3})", "\"update\": found 3, expected one of posterior, roxels"},
      {R"({"point": [1, 2]})", "\"point\": found [1,2], expected 3 numbers"},
      {R"({"point": [1, 2, "3"]})", "\"point\": found [1,2,\"3\"], expected 3 numbers"},
      {R"({"point": 1})", "\"point\": found 1, expected 3 numbers"},
      {R"({"response": "log"})", "\"response\": found \"log\", expected srgb, linear or gamma:G"},
  };
  for (const auto& [text, message] : cases) {
    SCOPED_TRACE(text);
    Options options;
    const json before = kTable.to_json(options);
    EXPECT_THAT(rejection([&] { kTable.apply_json(options, json::parse(text), "config.json"); }),
                HasSubstr(message));
    EXPECT_EQ(kTable.to_json(options), before);
  }
}

TEST(OptionTable, ReadsJsonFiles) {
  Options options;
  const TempFolder folder;
  const auto file = folder / "options.json";
  std::ofstream(file) << R"({"levels": 5})";
  kTable.apply_json_file(options, file);
  EXPECT_EQ(options.levels, 5);
  const std::vector<std::pair<std::string, std::string>> bad = {
      {R"({"levels": 5,)", "a syntax error"},
      {"", "a syntax error"},
      {R"({"levels": NaN})", "a syntax error"},
      {R"({"voxel-size": 1e999})", "a syntax error"},
      {R"({"levels": 5, "levels": 6})", "the same key twice"},
  };
  for (const auto& [text, message] : bad) {
    SCOPED_TRACE(text);
    std::ofstream(file) << text;
    EXPECT_THAT(rejection([&] { kTable.apply_json_file(options, file); }),
                AllOf(HasSubstr(file.string()), HasSubstr(message)));
  }
  std::filesystem::remove(file);
  EXPECT_THAT(rejection([&] { kTable.apply_json_file(options, file); }), HasSubstr("no such file"));
}

TEST(OptionTable, ValidatesWhatCodeHasSet) {
  using Change = std::function<void(Options&)>;
  const std::vector<std::pair<Change, std::string>> cases = {
      {[](Options& o) { o.voxel_size = std::nan(""); }, "--voxel-size: found nan, expected a number > 0"},
      {[](Options& o) { o.voxel_size = INFINITY; }, "--voxel-size: found inf, expected a number > 0"},
      {[](Options& o) { o.levels = 0; }, "--levels: found 0, expected a whole number in [1, 10]"},
      {[](Options& o) { o.near = -1; }, "--near: found -1, expected a number > 0"},
      {[](Options& o) { o.update = static_cast<Update>(9); }, "expected one of posterior, roxels"},
      {[](Options& o) { o.point[2] = 20; }, "--point: found 1,2,20, expected 3 numbers"},
      {[](Options& o) { o.bounds.emplace().fill(std::nan("")); }, "--bounds: found nan,nan"},
      {[](Options& o) { o.near = 3, o.far = 2; }, "near must be below far"},
      {[](Options& o) { o.pass.passes = 2; }, "strength must not be above passes"},
  };
  EXPECT_NO_THROW(kTable.validate(Options{}));
  for (const auto& [change, message] : cases) {
    Options options;
    change(options);
    EXPECT_THAT(rejection([&] { kTable.validate(options); }), HasSubstr(message));
  }
}

TEST(OptionTable, NamesEveryFieldInJsonWithItsDefault) {
  EXPECT_EQ(kTable.to_json(Options{}), json::parse(R"({
    "adaptive": true, "interpolate": false, "levels": 3, "seed": 1, "voxel-size": 0.25, "floor": 0.5,
    "response": "srgb", "near": null, "far": null, "limit": null, "surround": null, "update": "posterior",
    "point": [1, 2, 3], "bounds": null, "strength": 5, "passes": 8})"));
}

RC_GTEST_PROP(OptionTable, JsonRestoresTheSameOptions, ()) {
  const auto number = [](int low, int high) {
    return static_cast<double>(*rc::gen::inRange(low, high)) / *rc::gen::inRange(1, 1000);
  };
  Options options;
  options.adaptive = *rc::gen::arbitrary<bool>();
  options.levels = *rc::gen::inRange(1, 11);
  options.seed = *rc::gen::inRange<std::uint64_t>(0, std::numeric_limits<std::int64_t>::max());
  options.voxel_size = number(1, 100000);
  if (*rc::gen::arbitrary<bool>()) options.near = number(1, 100000);
  if (*rc::gen::arbitrary<bool>()) options.surround = *rc::gen::arbitrary<bool>();
  if (*rc::gen::arbitrary<bool>()) options.bounds.emplace().fill(number(-1000, 1000));
  options.update = *rc::gen::element(Update::kPosterior, Update::kRoxels);

  const json saved = kTable.to_json(options);
  Options from_file, from_text;
  kTable.apply_json(from_file, json::parse(saved.dump()), "saved");
  RC_ASSERT(kTable.to_json(from_file) == saved);
  for (const OptionField& field : kTable.fields())
    kTable.set(from_text, field.name, to_text(field.get(&options)));
  RC_ASSERT(kTable.to_json(from_text) == saved);
}

TEST(OptionTable, SpellsFlagsSoThatTheyChangeTheDefault) {
  std::vector<std::string> flags;
  for (const OptionField& field : kTable.fields()) flags.push_back(field.flag());
  EXPECT_THAT(flags, ElementsAre("--no-adaptive", "--interpolate", "--levels", "--seed", "--voxel-size",
                                 "--floor", "--response", "--near", "--far", "--limit", "--surround",
                                 "--update", "--point", "--bounds", "--strength", "--passes"));
}

TEST(OptionTable, RendersMarkdown) {
  const std::string page = kTable.markdown();
  EXPECT_THAT(page, HasSubstr("### Volume\n\n| option | default |"));
  EXPECT_THAT(page, HasSubstr("| `--no-adaptive` | adaptive is on |  | Sample where there is detail |  |\n"));
  EXPECT_THAT(page,
              HasSubstr("| `--voxel-size NUMBER` | 0.25 | a number > 0 (world units) | Finest edge |  |\n"));
  EXPECT_THAT(page, HasSubstr("| `--near NUMBER` | from the cameras | a number > 0 | Nearest |  |\n"));
  EXPECT_THAT(page, HasSubstr("| `--update posterior\\|roxels` | posterior | one of posterior, roxels |"));
  EXPECT_THAT(page, HasSubstr("| Prior strength | equations, section 4 |\n"));
  EXPECT_EQ(std::count(page.begin(), page.end(), '#'), 9);  // three groups of "###"
}

TEST(OptionTable, RendersHelp) {
  const std::string help = kTable.help();
  EXPECT_THAT(
      help, HasSubstr("Volume:\n  --no-adaptive                   Turn off: Sample where there is detail\n"));
  EXPECT_THAT(help, HasSubstr("[world units; > 0; default: 0.25]"));
  EXPECT_THAT(help, HasSubstr("--bounds X0,Y0,Z0,X1,Y1,Z1"));
  EXPECT_THAT(help, HasSubstr("[in [1, 100]; default: 8]"));
}

TEST(OptionTable, HelpKeepsToAHundredColumns) {
  std::string sentence;
  for (int i = 0; i < 40; ++i) sentence += (i ? " word" : "word") + std::to_string(i);
  OptionTable<PassOptions> table;
  table.add("passes", &PassOptions::passes).help(sentence);
  std::istringstream lines(table.help());
  std::string unwrapped;
  for (std::string line; std::getline(lines, line);) {
    EXPECT_LE(line.size(), 100u) << line;
    unwrapped += line.substr(std::min(line.size(), line.find_first_not_of(' '))) + " ";
  }
  EXPECT_THAT(unwrapped, HasSubstr(sentence + " [default: 8]"));
}

TEST(OptionTable, RefusesANameTwice) {
  OptionTable<PassOptions> table;
  table.add("passes", &PassOptions::passes);
  EXPECT_THROW(table.add("passes", &PassOptions::passes), std::logic_error);
}

TEST(OptionTable, AChoiceMayBeCalledAuto) {
  OptionTable<Options> table;
  table.add("update", &Options::update, {{"auto", Update::kRoxels}, {"posterior", Update::kPosterior}});
  Options from_text, from_json;
  table.set(from_text, "update", "auto");
  table.apply_json(from_json, json::parse(R"({"update": "auto"})"), "config.json");
  EXPECT_EQ(from_text.update, Update::kRoxels);
  EXPECT_EQ(from_json.update, Update::kRoxels);
}

TEST(OptionTable, BindsThroughACallable) {
  OptionTable<Options> table;
  table.add("strength", [](Options& o) -> double& { return o.pass.strength; });
  Options options;
  table.set(options, "strength", "9");
  EXPECT_EQ(options.pass.strength, 9);
}

}  // namespace
}  // namespace roxel
