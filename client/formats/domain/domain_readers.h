// The readers behind ReadPlanarDomain, one for each format. REQUIRES: domain.name is set, all else is empty. Private to
// this folder.
#ifndef WELLSPACE_CLIENT_FORMATS_DOMAIN_DOMAIN_READERS_H_
#define WELLSPACE_CLIENT_FORMATS_DOMAIN_DOMAIN_READERS_H_

#include <string>

#include "absl/status/status.h"
#include "client/formats/domain/planar_domain.h"
#include "client/formats/domain/read_planar_domain.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/line_reader.h"

namespace wellspace::formats {

// `path` is that of the file: the one with the points may be beside it.
absl::Status ReadPoly(InputFile& file, const std::string& path, PlanarDomain& domain);
absl::Status ReadGeoJson(InputFile& file, const DomainOptions& options, PlanarDomain& domain);
absl::Status ReadGeoJsonLines(InputFile& file, const DomainOptions& options, PlanarDomain& domain);
absl::Status ReadWkt(InputFile& file, const DomainOptions& options, PlanarDomain& domain);
absl::Status ReadShapefile(InputFile& file, const DomainOptions& options, PlanarDomain& domain);
absl::Status ReadAdcircBoundary(InputFile& file, PlanarDomain& domain);
absl::Status ReadObjLines(InputFile& file, PlanarDomain& domain);
absl::Status ReadPolylines(InputFile& file, const DomainOptions& options, PlanarDomain& domain);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_DOMAIN_DOMAIN_READERS_H_
