#include "roxel/sky/sun_position.h"
