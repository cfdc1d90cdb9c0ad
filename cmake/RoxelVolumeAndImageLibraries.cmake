# Finds OpenVDB and OpenImageIO as Debian ships them; used by roxel's build and, installed, by
# find_package(roxel). A macro, because find_package reports through variables of the caller's scope.
macro(roxel_find_volume_and_image_libraries)
  set(_roxel_module_path "${CMAKE_MODULE_PATH}")
  set(_roxel_log_level "${CMAKE_MESSAGE_LOG_LEVEL}")
  # OpenVDB brings a find module instead of a config file; it lies beside the library.
  list(APPEND CMAKE_MODULE_PATH ${CMAKE_PREFIX_PATH} /usr/lib/${CMAKE_LIBRARY_ARCHITECTURE}/cmake/OpenVDB)
  # Both look for Imath, which complains of Python bindings that nobody asked for: not shown.
  set(CMAKE_MESSAGE_LOG_LEVEL WARNING)
  find_package(OpenImageIO REQUIRED)
  find_package(OpenVDB REQUIRED)
  set(CMAKE_MODULE_PATH "${_roxel_module_path}")
  set(CMAKE_MESSAGE_LOG_LEVEL "${_roxel_log_level}")

  # OpenImageIO's target names the headers of OpenCV, which are not installed with it and not needed.
  get_target_property(_roxel_folders OpenImageIO::OpenImageIO INTERFACE_INCLUDE_DIRECTORIES)
  foreach(_roxel_folder IN LISTS _roxel_folders)
    if(NOT EXISTS "${_roxel_folder}")
      list(REMOVE_ITEM _roxel_folders "${_roxel_folder}")
    endif()
  endforeach()
  set_target_properties(OpenImageIO::OpenImageIO PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "${_roxel_folders}")
  unset(_roxel_module_path)
  unset(_roxel_log_level)
  unset(_roxel_folders)
endmacro()
