#include "roxel/synth/world.h"

#include <array>
#include <cstdio>

namespace roxel {
namespace {

struct Entry {
  const char* name;
  WorldKind kind;
  World (*make)(const WorldRequest&);
  WorldDefaults defaults;
};

constexpr int kStreetImages = 14 * 20;

constexpr std::array<Entry, 6> kWorlds = {{
    {"plane", WorldKind::kPlane, plane_world, {15, 400, 300, LightKind::kConstant, 12}},
    {"head", WorldKind::kHead, head_world, {20, 400, 300, LightKind::kConstant, 12}},
    {"mug", WorldKind::kMug, mug_world, {24, 352, 288, LightKind::kConstant, 12}},
    {"table", WorldKind::kTable, table_world, {24, 640, 480, LightKind::kConstant, 9}},
    {"street", WorldKind::kStreet, street_world, {160, 324, 256, LightKind::kMix, 8, kStreetImages}},
    {"flights", WorldKind::kFlights, flights_world, {60, 640, 480, LightKind::kMix, 6}},
}};

const Entry& entry(WorldKind kind) {
  std::size_t i = 0;
  while (kWorlds[i].kind != kind) ++i;
  return kWorlds[i];
}

}  // namespace

std::optional<WorldKind> find_world(const std::string& name) {
  for (const Entry& world : kWorlds)
    if (name == world.name) return world.kind;
  return std::nullopt;
}

WorldDefaults world_defaults(WorldKind kind) { return entry(kind).defaults; }

World make_world(WorldKind kind, const WorldRequest& request) { return entry(kind).make(request); }

std::string shot_name(int index) {
  char name[16];
  std::snprintf(name, sizeof name, "%03d", index);
  return name;
}

void give_each_shot_its_occasion(World& world) {
  constexpr UtcSeconds kFirst = 1686812400;  // 2023-06-15T07:00:00Z
  constexpr double kHour = 3600, kDay = 24 * kHour;
  for (int i = 0; i < static_cast<int>(world.shots.size()); ++i) {
    world.shots[i].occasion = i;
    world.times_utc_s.push_back(kFirst + (i % 91) * kDay + (i * 5 % 9) * kHour);
  }
}

}  // namespace roxel
