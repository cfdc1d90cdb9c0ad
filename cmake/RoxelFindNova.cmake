# libnova brings no CMake file: a target for it, for roxel's build and, installed, for find_package(roxel).
if(NOT TARGET Nova::nova)
  find_path(ROXEL_NOVA_INCLUDE_DIR libnova/libnova.h REQUIRED)
  find_library(ROXEL_NOVA_LIBRARY nova REQUIRED)
  mark_as_advanced(ROXEL_NOVA_INCLUDE_DIR ROXEL_NOVA_LIBRARY)
  add_library(Nova::nova UNKNOWN IMPORTED)
  set_target_properties(Nova::nova PROPERTIES
    IMPORTED_LOCATION "${ROXEL_NOVA_LIBRARY}" INTERFACE_INCLUDE_DIRECTORIES "${ROXEL_NOVA_INCLUDE_DIR}")
endif()
