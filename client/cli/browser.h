// The browser of the one who runs the tool.
#ifndef WELLSPACE_CLIENT_CLI_BROWSER_H_
#define WELLSPACE_CLIENT_CLI_BROWSER_H_

#include <string>

namespace wellspace::cli {

// Starts a viewer of the file `path`, and does not wait for it: the first program of $BROWSER; without one xdg-open,
// where there is a display. Returns whether a program was started.
//
// Threads:    reads the environment.
bool OpenInBrowser(const std::string& path);

}  // namespace wellspace::cli

#endif  // WELLSPACE_CLIENT_CLI_BROWSER_H_
