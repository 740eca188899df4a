// Prints what lib3mf reads of a 3MF file, strictly, as JSON: the unit, warnings, materials, and each item's
// object with its triangles in world space. usage: threemf_facts FILE
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "Model/COM/NMR_DLLInterfaces.h"

namespace {

NMR::PLib3MFModelReader *reader;

void check(LIB3MFRESULT result, const char *what) {
  if (result == 0) return;
  DWORD code = 0;
  LPCSTR message = nullptr;
  if (reader) NMR::lib3mf_getlasterror(reader, &code, &message);
  std::fprintf(stderr, "%s: %08x %s\n", what, static_cast<unsigned>(result), message ? message : "");
  std::exit(1);
}

struct Sums {
  double volume = 0, low[3] = {1e300, 1e300, 1e300}, high[3] = {-1e300, -1e300, -1e300};
};

void add(const double (&p)[3][3], Sums *sums) {
  double cross[3];
  for (int i = 0; i < 3; i++) {
    int j = (i + 1) % 3, k = (i + 2) % 3;
    cross[i] = p[1][j] * p[2][k] - p[1][k] * p[2][j];
  }
  for (int i = 0; i < 3; i++) {
    sums->volume += p[0][i] * cross[i] / 6;
    for (const auto &point : p) {
      if (point[i] < sums->low[i]) sums->low[i] = point[i];
      if (point[i] > sums->high[i]) sums->high[i] = point[i];
    }
  }
}

void print_item(NMR::PLib3MFModelBuildItem *item) {
  NMR::PLib3MFModelObjectResource *object;
  NMR::MODELTRANSFORM transform;
  DWORD id, type, points, triangles;
  ULONG length;
  BOOL is_manifold, is_valid;
  char part[256] = "", name[256] = "";
  check(NMR::lib3mf_builditem_getobjectresource(item, &object), "object");
  check(NMR::lib3mf_builditem_getobjectresourceid(item, &id), "id");
  check(NMR::lib3mf_builditem_getobjecttransform(item, &transform), "transform");
  check(NMR::lib3mf_builditem_getpartnumberutf8(item, part, sizeof part, &length), "part number");
  check(NMR::lib3mf_object_getnameutf8(object, name, sizeof name, &length), "name");
  check(NMR::lib3mf_object_gettype(object, &type), "type");
  check(NMR::lib3mf_object_isvalidobject(object, &is_valid), "valid");
  check(NMR::lib3mf_meshobject_getvertexcount(object, &points), "vertices");
  check(NMR::lib3mf_meshobject_gettrianglecount(object, &triangles), "triangles");
  check(NMR::lib3mf_meshobject_ismanifoldandoriented(object, &is_manifold), "manifold");
  Sums sums;
  for (DWORD t = 0; t < triangles; t++) {
    NMR::MODELMESHTRIANGLE triangle;
    double world[3][3];
    check(NMR::lib3mf_meshobject_gettriangle(object, t, &triangle), "triangle");
    for (int k = 0; k < 3; k++) {
      NMR::MODELMESHVERTEX vertex;
      check(NMR::lib3mf_meshobject_getvertex(object, triangle.m_nIndices[k], &vertex), "vertex");
      for (int row = 0; row < 3; row++) {
        world[k][row] = static_cast<double>(transform.m_fFields[row][3]);
        for (int c = 0; c < 3; c++)
          world[k][row] +=
              static_cast<double>(transform.m_fFields[row][c]) * static_cast<double>(vertex.m_fPosition[c]);
      }
    }
    add(world, &sums);
  }
  std::printf("{\"object\":%u,\"type\":\"%s\",\"name\":\"%s\",\"part\":\"%s\",\"valid\":%s,\"vertices\":%u,"
              "\"triangles\":%u,\"manifold\":%s,"
              "\"volume\":%.17g,\"bounds\":[%.9g,%.9g,%.9g,%.9g,%.9g,%.9g]}",
              id,
              type == NMR::MODELOBJECTTYPE_MODEL     ? "model"
              : type == NMR::MODELOBJECTTYPE_SURFACE ? "surface"
                                                     : "?",
              name, part, is_valid ? "true" : "false", points, triangles, is_manifold ? "true" : "false",
              sums.volume, sums.low[0], sums.low[1], sums.low[2], sums.high[0], sums.high[1], sums.high[2]);
}

void print_materials(NMR::PLib3MFModel *model) {
  NMR::PLib3MFModelResourceIterator *groups;
  BOOL more;
  const char *comma = "";
  check(NMR::lib3mf_model_getbasematerials(model, &groups), "materials");
  while (NMR::lib3mf_resourceiterator_movenext(groups, &more) == 0 && more) {
    NMR::PLib3MFModelResource *group;
    DWORD count;
    check(NMR::lib3mf_resourceiterator_getcurrent(groups, &group), "group");
    check(NMR::lib3mf_basematerial_getcount(group, &count), "count");
    for (DWORD i = 0; i < count; i++) {
      char name[256] = "";
      ULONG length;
      BYTE r, g, b, a;
      check(NMR::lib3mf_basematerial_getnameutf8(group, i, name, sizeof name, &length), "name");
      check(NMR::lib3mf_basematerial_getdisplaycolor(group, i, &r, &g, &b, &a), "colour");
      std::printf("%s{\"name\":\"%s\",\"color\":[%u,%u,%u,%u]}", comma, name, r, g, b, a);
      comma = ",";
    }
  }
}

} // namespace

int main(int count, char **arguments) {
  NMR::PLib3MFModel *model;
  NMR::PLib3MFModelBuildItemIterator *items;
  DWORD unit, warnings;
  BOOL more;
  if (count != 2) return 2;
  check(NMR::lib3mf_createmodel(&model), "model");
  check(NMR::lib3mf_model_queryreader(model, "3mf", &reader), "reader");
  check(NMR::lib3mf_reader_setstrictmodeactive(reader, 1), "strict");
  check(NMR::lib3mf_reader_readfromfileutf8(reader, arguments[1]), "read");
  check(NMR::lib3mf_reader_getwarningcount(reader, &warnings), "warnings");
  check(NMR::lib3mf_model_getunit(model, &unit), "unit");
  std::printf("{\"unit\":%u,\"warnings\":%u,\"materials\":[", unit, warnings);
  print_materials(model);
  std::printf("],\"items\":[");
  check(NMR::lib3mf_model_getbuilditems(model, &items), "items");
  for (const char *comma = ""; NMR::lib3mf_builditemiterator_movenext(items, &more) == 0 && more;
       comma = ",") {
    NMR::PLib3MFModelBuildItem *item;
    check(NMR::lib3mf_builditemiterator_getcurrent(items, &item), "item");
    std::fputs(comma, stdout);
    print_item(item);
  }
  std::puts("]}");
  return 0;
}
