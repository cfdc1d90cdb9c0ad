#include "roxel/synth/world.h"
namespace roxel { World table_world(const WorldRequest& r) { return plane_world(r); } }
