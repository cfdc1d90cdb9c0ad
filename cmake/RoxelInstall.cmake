# What `cmake --install` adds to the libraries and headers of the modules: find_package(roxel).
include(CMakePackageConfigHelpers)

set(roxel_config_dir ${CMAKE_INSTALL_LIBDIR}/cmake/roxel)
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/roxelConfig.cmake.in
  ${PROJECT_BINARY_DIR}/roxelConfig.cmake INSTALL_DESTINATION ${roxel_config_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/roxelConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(EXPORT roxelTargets NAMESPACE roxel:: DESTINATION ${roxel_config_dir})
install(FILES ${PROJECT_BINARY_DIR}/roxelConfig.cmake ${PROJECT_BINARY_DIR}/roxelConfigVersion.cmake
              ${CMAKE_CURRENT_LIST_DIR}/RoxelVolumeAndImageLibraries.cmake
              ${CMAKE_CURRENT_LIST_DIR}/RoxelFindNova.cmake
        DESTINATION ${roxel_config_dir})
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})
