// Domains in the plane from files.
//
// Formats:
//   poly     Triangle's. Points as in a .node file; if there are 0 of them, they are in the .node file beside it. Then
//            "segments markers" and a line "index end end [marker]" for each segment; the number of holes and a line
//            "index x y" for each; the number of regions and a line "index x y attribute [max-area]" for each. The
//            file may end after the points or any later part. Indices count from 0 or 1, those of ends as the points'.
//            A region's largest area of 0 or less is none; one without is the attribute. Faces: kHoles.
//   geojson  RFC 7946: any geometry, Feature or FeatureCollection. Rings of polygons, closed by repeating the first
//            position or not, and lines become segments; positions of Point and MultiPoint become points. Coordinates
//            are taken as those of a plane, altitudes and members that the format does not know are skipped. Two
//            positions that are equal are two points, but for those that follow each other in a ring or a line, and for
//            the last of a ring or a closed line. Rings that enclose nothing and lines without length are left out.
//            Faces: kUnion, of the features; without a polygon kBox.
//   geojsonl Texts of geojson, one after the other, in lines of their own or not; the separator of RFC 8142 may stand
//            before each. Each is a Feature or a geometry, or what a file of geojson may be. A geometry is a feature.
//   wkt      Well-known text of geometries, one after the other, separated by blanks, line ends or semicolons: POINT,
//            LINESTRING, POLYGON, MULTIPOINT and so on, TRIANGLE, GEOMETRYCOLLECTION, EMPTY ones too, in any case, with
//            Z, M or ZM and an "SRID=…;" before them or not. As the features of a file of geojson.
//   shp      ESRI's shapefile, without the files beside it: points, polylines and polygons, with Z and M or not. Each
//            record is as a feature of geojson, rings in any order; null shapes are counted.
//   adcirc   ADCIRC's fort.14 or SCHISM's grid: its boundaries are segments, with markers from 1 on in their order, and
//            their nodes the points. Elements and other nodes are not looked at. Faces: kEvenOdd.
//   obj      Wavefront's: all vertices ("v") become points, and lines ("l") segments, with indices from 1 or, negative,
//            from the last vertex back. A third coordinate has to be the same in all. Faces ("f") are skipped. Faces
//            of the domain: kBox.
//   csv      Polylines, a point a line, fields separated as in a table of points. Two columns, or those named x and y,
//            lon and lat, easting and northing, are coordinates. A polyline ends at a blank line, at one that starts
//            with '>', as GMT has it, or, if there is a column named id, line, polyline, ring, part, path, shape or
//            feature, where that changes; then blank lines mean nothing. It is closed if its last point is its first;
//            a polyline of one point is a point. Faces: kBox.
// In those of text lines end in LF, CRLF or CR, and '#' at the start of a line or after a blank starts a comment. Each
// may be compressed by gzip, as "lake.poly.gz" or on standard input.
#ifndef WELLSPACE_CLIENT_FORMATS_DOMAIN_READ_PLANAR_DOMAIN_H_
#define WELLSPACE_CLIENT_FORMATS_DOMAIN_READ_PLANAR_DOMAIN_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/formats/domain/planar_domain.h"

namespace wellspace::formats {

struct DomainOptions {
  std::string format = {};  // empty: by the file's extension; standard input has none
  // Of geojson: the property that holds the attribute of a feature's polygons, a number, and that which holds the
  // marker of all its segments, a whole number. Empty: none. A feature may lack them, or have null. A polygon with an
  // attribute gets a seed for all inside of it.
  std::string region_property = {};
  std::string marker_property = {};
  // Of csv: the two columns that hold the coordinates, and the one that tells polylines apart; names, in any case, or
  // numbers counted from 1. Empty: see above.
  std::vector<std::string> columns = {};
  std::string id_column = {};
};

// The names that DomainOptions::format may take.
std::vector<std::string> DomainFormats();

// The formats whose files have a planar domain and no cloud: all but adcirc, obj and csv.
std::vector<std::string> DomainOnlyFormats();
bool IsDomainFormat(const std::string& format);

// Whether the extension of `path` says that it is of such a format: .poly, .geojson and so on, also with .gz.
bool IsDomainPath(const std::string& path);

// Reads the domain of `path`; "-" is standard input. Nothing is cleaned but the things that PlanarDomain counts.
//
// Guarantees: (1) Coordinates are correctly rounded, to the bit, and finite; ends of segments are points.
//             (2) Every point, segment and seed has its place in the file.
//             (3) Memory is asked for as the file has things, never as it announces them.
// Complexity: one pass; memory for the domain, and for one geometry of geojson or one polyline of csv.
// Errors:     of opening and reading; INVALID_ARGUMENT "FILE:LINE: …", in geojson with the path to the value, for what
//             is not such a file: a number that is none or not finite, an end that is no point, other
//             counts than announced, an end in the middle; and for a file without points.
absl::StatusOr<PlanarDomain> ReadPlanarDomain(const std::string& path, const DomainOptions& options = {});

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_DOMAIN_READ_PLANAR_DOMAIN_H_
