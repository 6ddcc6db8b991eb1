# The places of installed files. Components: runtime (the tool), server, development; and python, which only packages
# install (`cmake --install` does so with `--component python` alone, since pip is the way elsewhere).

if(NOT WELLSPACE_INSTALL)
  function(wellspace_install_libraries)
  endfunction()
  return()
endif()

# Where Debian has libraries, under any prefix: its compilers, CMake and pkg-config look there.
if(CMAKE_LIBRARY_ARCHITECTURE)
  set(CMAKE_INSTALL_LIBDIR lib/${CMAKE_LIBRARY_ARCHITECTURE} CACHE PATH "Object code libraries")
endif()
include(GNUInstallDirs)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/wellspace)
# From the files of pkg-config to the prefix, so that what is installed can be moved.
file(RELATIVE_PATH up /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)

# wellspace_install_libraries(COMPONENT NAMES…) installs the targets wellspace_NAME as wellspace::NAME, and has
# find_package(wellspace COMPONENTS COMPONENT) bring them. The first depends on the second, and so on.
function(wellspace_install_libraries component)
  foreach(name IN LISTS ARGN)
    set_target_properties(wellspace_${name} PROPERTIES EXPORT_NAME ${name})
    install(TARGETS wellspace_${name} EXPORT wellspace-${component}
            ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development
            INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
  endforeach()
  install(EXPORT wellspace-${component} NAMESPACE wellspace:: FILE wellspace-${component}.cmake
          DESTINATION ${package_dir} COMPONENT development)
  list(TRANSFORM ARGN PREPEND -lwellspace_ OUTPUT_VARIABLE libraries)
  list(JOIN libraries " " libraries)
  string(REPLACE _ - module wellspace-${component})
  configure_file(${PROJECT_SOURCE_DIR}/cmake/pkgconfig/${module}.pc.in ${PROJECT_BINARY_DIR}/pkgconfig/${module}.pc @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/pkgconfig/${module}.pc
          DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT development)
endfunction()
