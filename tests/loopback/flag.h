/* A skinned and morphed model. */
#ifndef FLAG_H
#define FLAG_H

/* A rectangle from (0, 0, 0) to (2, 1, 0) whose points all have the joint "bone". Its node "skinned" is
 * translated by (100, 0, 0). In one second the clip "wave" turns the bone by 90 degrees about z, and raises
 * the weight of the morph target (0, 0, 1) to a half. The node "shown" shows the mesh without the skin. */
static const char flag[] =
    "{'asset':{'version':'2.0'},'scene':0,'scenes':[{'nodes':[0,1,2]}],'nodes':[{'name':'bone'},"
    "{'name':'skinned','mesh':0,'skin':0,'translation':[100,0,0]},{'name':'shown','mesh':0,"
    "'translation':[10,0,0]}],'skins':[{'joints':[0]}],'meshes':[{'name':'cloth',"
    "'primitives':[{'attributes':{'POSITION':0,'JOINTS_0':2,'WEIGHTS_0':3},"
    "'indices':1,'targets':[{'POSITION':4}]}]}],'animations':[{'name':'wave','samplers':[{'input':5,"
    "'output':6},{'input':5,'output':7}],'channels':[{'sampler':0,'target':{'node':0,'path':'rotation'}},"
    "{'sampler':1,'target':{'node':1,'path':'weights'}}]}],'accessors':[{'bufferView':0,"
    "'componentType':5126,'count':4,'type':'VEC3','min':[0,0,0],'max':[2,1,0]},"
    "{'bufferView':1,'componentType':5123,'count':6,'type':'SCALAR'},"
    "{'bufferView':2,'componentType':5121,'count':4,'type':'VEC4'},"
    "{'bufferView':3,'componentType':5126,'count':4,'type':'VEC4'},"
    "{'bufferView':4,'componentType':5126,'count':4,'type':'VEC3','min':[0,0,1],'max':[0,0,1]},"
    "{'bufferView':5,'componentType':5126,'count':2,'type':'SCALAR','min':[0],'max':[1]},"
    "{'bufferView':6,'componentType':5126,'count':2,'type':'VEC4'},"
    "{'bufferView':7,'componentType':5126,'count':2,'type':'SCALAR'}],"
    "'bufferViews':[{'buffer':0,'byteLength':48},{'buffer':0,'byteOffset':48,'byteLength':12},"
    "{'buffer':0,'byteOffset':60,'byteLength':16},{'buffer':0,'byteOffset':76,'byteLength':64},"
    "{'buffer':0,'byteOffset':140,'byteLength':48},{'buffer':0,'byteOffset':188,'byteLength':8},"
    "{'buffer':0,'byteOffset':196,'byteLength':32},{'buffer':0,'byteOffset':228,'byteLength':8}],"
    "'buffers':[{'byteLength':236,'uri':'data:application/octet-stream;base64,"
    "AAAAAAAAAAAAAAAAAAAAQAAAAAAAAAAAAAAAQAAAgD8AAAAAAAAAAAAAgD8AAAAAAAABAAIAAAACAAMAAAAAAAAAAAAAAAAAAAAAAA"
    "AAgD8AAAAAAAAAAAAAAAAAAIA/AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAAAAAAAAAAAAAAAAAgD8A"
    "AAAAAAAAAAAAgD8AAAAAAAAAAAAAgD8AAAAAAAAAAAAAgD8AAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAPMENT/zBDU/AA"
    "AAAAAAAD8='}]}";

#endif
