#include "server/wellspaced.h"

int main(int argc, char** argv) { return wellspace::server::RunWellspaced(argc, argv); }
