#ifndef WELLSPACE_SERVER_BASE_VERSION_H_
#define WELLSPACE_SERVER_BASE_VERSION_H_

namespace wellspace::server {

// MAJOR.MINOR.PATCH of the CMake project.
inline constexpr char kVersion[] = WELLSPACE_VERSION;

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_BASE_VERSION_H_
