# Target Hdf5Static::hdf5: Debian's static HDF5, since the shared one brings libcurl and Kerberos along; it only writes:
# docs/adr/0028-hdf5-is-linked-statically.md.
find_package(ZLIB QUIET)
find_path(HDF5_STATIC_HEADERS hdf5.h PATH_SUFFIXES hdf5/serial)
find_library(HDF5_STATIC_ARCHIVE libhdf5.a PATH_SUFFIXES hdf5/serial)
mark_as_advanced(HDF5_STATIC_HEADERS HDF5_STATIC_ARCHIVE)

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(Hdf5Static REQUIRED_VARS HDF5_STATIC_ARCHIVE HDF5_STATIC_HEADERS ZLIB_FOUND)
if(Hdf5Static_FOUND AND NOT TARGET Hdf5Static::hdf5)
  add_library(Hdf5Static::hdf5 INTERFACE IMPORTED)
  target_include_directories(Hdf5Static::hdf5 SYSTEM INTERFACE ${HDF5_STATIC_HEADERS})
  target_link_libraries(Hdf5Static::hdf5 INTERFACE ${HDF5_STATIC_ARCHIVE} sz ZLIB::ZLIB ${CMAKE_DL_LIBS} m)
endif()
