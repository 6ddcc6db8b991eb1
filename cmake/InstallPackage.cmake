# The files that find_package(wellspace) finds, and the protos, of which other languages make their clients.
include(CMakePackageConfigHelpers)

configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/wellspace-config.cmake.in
                              ${PROJECT_BINARY_DIR}/wellspace-config.cmake INSTALL_DESTINATION ${package_dir}
                              NO_CHECK_REQUIRED_COMPONENTS_MACRO NO_SET_AND_CHECK_MACRO)
# Before 1.0 a minor version may break what the last one had.
write_basic_package_version_file(${PROJECT_BINARY_DIR}/wellspace-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/wellspace-config.cmake ${PROJECT_BINARY_DIR}/wellspace-config-version.cmake
        DESTINATION ${package_dir} COMPONENT development)
if(builds_formats)
  install(FILES ${PROJECT_SOURCE_DIR}/cmake/FindHdf5Static.cmake DESTINATION ${package_dir} COMPONENT development)
endif()
if(builds_client)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/proto/wellspace/v1 DESTINATION ${CMAKE_INSTALL_DATADIR}/wellspace/proto/wellspace
          COMPONENT development FILES_MATCHING PATTERN *.proto)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/proto/google DESTINATION ${CMAKE_INSTALL_DATADIR}/wellspace/proto
          COMPONENT development FILES_MATCHING PATTERN *.proto)
endif()
