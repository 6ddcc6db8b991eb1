# Debian's packages, made by cpack: scripts/package. deploy/debian has what only packages have.

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME wellspace)
set(CPACK_PACKAGE_CONTACT "Wellspace maintainers <wellspace@localhost>" CACHE STRING "Maintainer of the packages")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "") # would come before those of the packages
set(CPACK_INSTALL_PREFIX /usr)
set(CPACK_SET_DESTDIR ON) # so that scripts of the installation see the prefix as it will be
set(CPACK_STRIP_FILES ON)
set(CPACK_PRE_BUILD_SCRIPTS ${PROJECT_SOURCE_DIR}/deploy/debian/finish.cmake)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
    OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_WELLSPACE_SOURCE_DIR ${PROJECT_SOURCE_DIR})
set(CPACK_WELLSPACE_BINARY_DIR ${PROJECT_BINARY_DIR})

# core_development has no files of its own: finish.cmake moves those of the core there. So `cmake --install` has one
# component for development, and packages have two.
set(CPACK_COMPONENTS_ALL runtime server development core_development python documentation)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)

# wellspace_package(COMPONENT NAME SECTION SUMMARY TEXT) describes the package of a component.
macro(wellspace_package component name section summary text)
  set(CPACK_DEBIAN_${component}_PACKAGE_NAME ${name})
  set(CPACK_DEBIAN_${component}_PACKAGE_SECTION ${section})
  set(CPACK_DEBIAN_${component}_DESCRIPTION "${summary}\n${text}")
endmacro()

wellspace_package(RUNTIME wellspace math "quality meshes of point clouds and planar domains (tool)"
"Wellspace makes meshes of triangles and tetrahedra of quality from clouds of
points and planar domains, and simplices up to 6-D. This is the command line
tool, which meshes by itself or by a server, and checks and draws meshes.")
# Cairo is loaded by its name, where dpkg-shlibdeps does not see it.
set(CPACK_DEBIAN_RUNTIME_PACKAGE_DEPENDS "libcairo2 (>= 1.16)")
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SUGGESTS wellspaced)

wellspace_package(SERVER wellspaced math "quality meshes of point clouds and planar domains (server)"
"Wellspace makes meshes of triangles and tetrahedra of quality from clouds of
points and planar domains, and simplices up to 6-D. This is the server, with
an API by gRPC. As a service of systemd it listens on the loopback only.")
set(CPACK_DEBIAN_SERVER_PACKAGE_SUGGESTS wellspace)
set(debian_dir ${PROJECT_SOURCE_DIR}/deploy/debian)
set(CPACK_DEBIAN_SERVER_PACKAGE_CONTROL_EXTRA ${debian_dir}/wellspaced/postinst ${debian_dir}/wellspaced/prerm
                                              ${debian_dir}/wellspaced/postrm ${debian_dir}/wellspaced/conffiles)

# The version of the packages, for those that are of the same build.
set(debian_version ${PROJECT_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE})

wellspace_package(CORE_DEVELOPMENT libwellspace-core-dev libdevel "quality meshes of point clouds and planar domains (C++ mesher)"
"Wellspace makes meshes of triangles and tetrahedra of quality from clouds of
points and planar domains, and simplices up to 6-D. This is the mesher as a
library, for linking statically, with files for CMake and pkg-config. It wants
neither gRPC nor HDF5.")
set(CPACK_DEBIAN_CORE_DEVELOPMENT_PACKAGE_DEPENDS "libabsl-dev, libtbb-dev")
# Earlier releases of libwellspace-dev had these files.
set(CPACK_DEBIAN_CORE_DEVELOPMENT_PACKAGE_BREAKS "libwellspace-dev (<< ${debian_version})")
set(CPACK_DEBIAN_CORE_DEVELOPMENT_PACKAGE_REPLACES "libwellspace-dev (<< ${debian_version})")

wellspace_package(DEVELOPMENT libwellspace-dev libdevel "quality meshes of point clouds and planar domains (C++ libraries)"
"Wellspace makes meshes of triangles and tetrahedra of quality from clouds of
points and planar domains, and simplices up to 6-D. These are its libraries,
for linking statically: the client of its server, and files of points and
meshes, with files for CMake and pkg-config, and the protos. The mesher is in
libwellspace-core-dev.")
# The compiler, since CMake finds Debian's gRPC only where gRPC's plugin for it is.
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS
    "libwellspace-core-dev (= ${debian_version}), libabsl-dev, libgrpc++-dev, protobuf-compiler-grpc, libprotobuf-dev, libhdf5-dev, libminizip-dev"
    "zlib1g-dev, liblzma-dev, pkg-config")
list(JOIN CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS ", " CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS)

wellspace_package(PYTHON python3-wellspace python "quality meshes of point clouds and planar domains (Python)"
"Wellspace makes meshes of triangles and tetrahedra of quality from clouds of
points and planar domains, and simplices up to 6-D. This is the package for
Python, a client of the server: arrays of numpy in and out.")
set(CPACK_DEBIAN_PYTHON_PACKAGE_ARCHITECTURE all)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SHLIBDEPS OFF)
set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "python3:any, python3-numpy, python3-grpcio, python3-protobuf")
set(CPACK_DEBIAN_PYTHON_PACKAGE_RECOMMENDS wellspaced)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SUGGESTS "libisal2, python3-meshio, python3-tqdm")
set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA ${debian_dir}/python3-wellspace/postinst
                                              ${debian_dir}/python3-wellspace/prerm)

wellspace_package(DOCUMENTATION wellspace-doc doc "quality meshes of point clouds and planar domains (documentation)"
"Wellspace makes meshes of triangles and tetrahedra of quality from clouds of
points and planar domains, and simplices up to 6-D. These are its pages, for
those who mesh, who write solvers and who run servers, and its examples.")
set(CPACK_DEBIAN_DOCUMENTATION_PACKAGE_ARCHITECTURE all)
set(CPACK_DEBIAN_DOCUMENTATION_PACKAGE_SHLIBDEPS OFF)
set(CPACK_DEBIAN_DOCUMENTATION_PACKAGE_SUGGESTS "wellspace, python3-wellspace, libwellspace-core-dev")
# As in the repository, so that links from page to page lead there. `cmake --install` leaves them out.
set(documentation_dir share/doc/wellspace-doc)
install(FILES README.md ARCHITECTURE.md DESTINATION ${documentation_dir} COMPONENT documentation EXCLUDE_FROM_ALL)
install(DIRECTORY docs examples DESTINATION ${documentation_dir} COMPONENT documentation EXCLUDE_FROM_ALL
        PATTERN make_sizes EXCLUDE PATTERN make_view.mjs EXCLUDE PATTERN reference EXCLUDE
        REGEX "examples/CMakeLists.txt$" EXCLUDE)

include(CPack)

# The files of the packages, and no others.
add_custom_target(wellspace_packaged)
add_dependencies(wellspace_packaged wellspace wellspaced wellspace_help_pages wellspace_python wellspace_core
                 wellspace_client_files wellspace_formats_domain wellspace_formats_surface)
