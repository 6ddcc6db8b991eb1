// The program `wellspaced`, as a function.
#ifndef WELLSPACE_SERVER_WELLSPACED_H_
#define WELLSPACE_SERVER_WELLSPACED_H_

namespace wellspace::server {

// Serves, or does what else the arguments ask for, as docs/operations.md says; returns the exit code. Signals, heaps
// and environment are the process's: it is to do nothing else.
int RunWellspaced(int argc, char** argv);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_WELLSPACED_H_
