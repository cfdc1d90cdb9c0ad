#include "roxel/synth/world.h"
namespace roxel { World street_world(const WorldRequest& r) { return plane_world(r); } }
