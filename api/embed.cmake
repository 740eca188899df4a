# Writes a C file that holds a file: cmake -DINPUT=... -DOUTPUT=... -DNAME=... -P embed.cmake
file(SHA256 "${INPUT}" hash)
file(READ "${INPUT}" hex HEX)
string(REGEX REPLACE "(................................)" "\\1\n" hex "${hex}")
string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${hex}")
file(WRITE "${OUTPUT}" "#include \"files.h\"\nstatic const unsigned char bytes[] = {\n${bytes}\n};\n"
  "const api_file ${NAME} = {bytes, sizeof bytes, \"${hash}\"};\n")
