#include "roxel/synth/world.h"
namespace roxel { World flights_world(const WorldRequest& r) { return plane_world(r); } }
