# Writes a C file that holds a file: cmake -DINPUT=... -DOUTPUT=... -DNAME=... -P embed.cmake
file(SHA256 "${INPUT}" hash)
include("${CMAKE_CURRENT_LIST_DIR}/bytes.cmake")
bytes_of(bytes "${INPUT}")
file(WRITE "${OUTPUT}" "#include \"files.h\"\n${BYTES_HEAD}static const unsigned char bytes[] =\n${bytes};\n"
  "const api_file ${NAME} = {bytes, sizeof bytes - 1, \"${hash}\"};\n")
