# Writes a C file that holds the page, the API reference, the example and the viewer, and OUTPUT.whole when all could be built:
#   cmake -DSOURCE=server/page -DFOLDER=build/page -DOUTPUT=page.c -P page.cmake
# FOLDER receives the packages, so that nothing is written beside the sources. They are installed again only when the
# lock file changes. Without npm, or when the packages cannot be fetched, the first two say what is missing and there is no viewer;
# since OUTPUT.whole is missing then, the next build tries again.
find_program(NPM npm)
find_program(NODE node)
set(missing "")
file(REMOVE "${OUTPUT}.whole")
file(MAKE_DIRECTORY "${FOLDER}")

# Another build that shares FOLDER may have made the same.
file(GLOB sources LIST_DIRECTORIES false "${SOURCE}/*" "${SOURCE}/../../api/client/*.js" "${SOURCE}/../../api/bytes.cmake"
     "${CMAKE_CURRENT_LIST_FILE}")
set(hashes "")
foreach(source ${sources})
  file(SHA256 "${source}" hash)
  string(APPEND hashes "${hash}")
endforeach()
string(SHA256 key "${hashes}")
set(made "${FOLDER}/${key}.c")
if(EXISTS "${made}")
  file(COPY_FILE "${made}" "${OUTPUT}")
  file(WRITE "${OUTPUT}.whole" "")
  return()
endif()

if(NOT NPM OR NOT NODE)
  set(missing "npm and node were not found")
else()
  foreach(name package.json package-lock.json)
    file(COPY_FILE "${SOURCE}/${name}" "${FOLDER}/${name}" ONLY_IF_DIFFERENT)
  endforeach()
  if("${FOLDER}/package-lock.json" IS_NEWER_THAN "${FOLDER}/node_modules/.package-lock.json")
    execute_process(
      COMMAND "${NPM}" ci --prefix "${FOLDER}" --ignore-scripts --prefer-offline --fetch-retries=1 --no-audit --no-fund
      RESULT_VARIABLE status OUTPUT_VARIABLE said ERROR_VARIABLE said)
    if(NOT status EQUAL 0)
      file(REMOVE_RECURSE "${FOLDER}/node_modules")
      message("${said}")
      set(missing "npm could not install the packages of server/page")
    endif()
  endif()
endif()

# array(NAME FILE): adds the file's bytes to the C file, as the array NAME, with a 0 behind them.
include("${CMAKE_CURRENT_LIST_DIR}/../api/bytes.cmake")
set(code "#include \"page.h\"\n${BYTES_HEAD}")
function(array name file)
  bytes_of(bytes "${file}")
  set(code "${code}static const unsigned char ${name}[] =\n${bytes};\n" PARENT_SCOPE)
endfunction()

# embed(NAME FILE [POLICY]): adds the file to the C file, as the api_page srv_NAME; with the brotli FILE.br where there is one.
function(embed name html)
  set(policy NULL)
  if(ARGC GREATER 2)
    set(policy "\"${ARGV2}\"")
  endif()
  set(packed "${FOLDER}/${name}.gz")
  execute_process(COMMAND gzip -9 -n -c "${html}" OUTPUT_FILE "${packed}" COMMAND_ERROR_IS_FATAL ANY)
  file(SHA256 "${html}" hash)
  array(${name} "${packed}")
  set(brotli "{0}")
  if(EXISTS "${html}.br")
    array(${name}_brotli "${html}.br")
    set(brotli "{${name}_brotli, sizeof ${name}_brotli - 1}")
  endif()
  string(APPEND code "const api_page srv_${name} = {{${name}, sizeof ${name} - 1}, ${brotli}, \"${hash}\", ${policy}};\n")
  set(code "${code}" PARENT_SCOPE)
endfunction()

if(missing)
  message(WARNING "the daemon has no page and no API reference: ${missing}")
  set(html "${FOLDER}/missing.html")
  configure_file("${SOURCE}/missing.html" "${html}" @ONLY)
  foreach(name page docs)
    embed(${name} "${html}" "default-src 'none'; img-src data:; frame-ancestors 'self'")
  endforeach()
  string(APPEND code "const api_page srv_viewer = {0};\n")
else()
  execute_process(COMMAND "${NODE}" "${SOURCE}/build.mjs" "${FOLDER}" COMMAND_ERROR_IS_FATAL ANY)
  foreach(name page docs)
    file(READ "${FOLDER}/${name}.policy" policy)
    embed(${name} "${FOLDER}/${name}.html" "${policy}")
  endforeach()
  embed(viewer "${FOLDER}/viewer.js")
  file(WRITE "${OUTPUT}.whole" "")
endif()
# The example loads three.js from where its import map says.
embed(example "${SOURCE}/example.html" "default-src 'none'; script-src 'self' 'unsafe-inline' https://cdn.jsdelivr.net; \
style-src 'unsafe-inline'; img-src blob: data:; connect-src 'self' blob: data:; base-uri 'none'; form-action 'none'; \
frame-ancestors 'self'")
file(WRITE "${OUTPUT}" "${code}")
if(EXISTS "${OUTPUT}.whole")
  file(GLOB older "${FOLDER}/*.c")
  file(REMOVE ${older} "${made}")
  file(COPY_FILE "${OUTPUT}" "${made}")
endif()
