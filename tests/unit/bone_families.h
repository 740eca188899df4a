/* The names that families of rigs give the joints of a biped (biped.h), in the order of biped_joints. */
#ifndef TEST_BONE_FAMILIES_H
#define TEST_BONE_FAMILIES_H

#include "biped.h"

static const char *const mixamo[BIPED_JOINTS] = {
    "mixamorig:Hips",           "mixamorig:Spine",         "mixamorig:Spine1",
    "mixamorig:Spine2",         "mixamorig:Neck",          "mixamorig:Head",
    "mixamorig:LeftUpLeg",      "mixamorig:LeftLeg",       "mixamorig:LeftFoot",
    "mixamorig:LeftToeBase",    "mixamorig:RightUpLeg",    "mixamorig:RightLeg",
    "mixamorig:RightFoot",      "mixamorig:RightToeBase",  "mixamorig:LeftShoulder",
    "mixamorig:LeftArm",        "mixamorig:LeftForeArm",   "mixamorig:LeftHand",
    "mixamorig:LeftHandIndex1", "mixamorig:RightShoulder", "mixamorig:RightArm",
    "mixamorig:RightForeArm",   "mixamorig:RightHand",     "mixamorig:RightHandIndex1"};
static const char *const numbered[BIPED_JOINTS] = {
    "mixamorig9Hips",           "mixamorig9Spine",         "mixamorig9Spine1",
    "mixamorig9Spine2",         "mixamorig9Neck",          "mixamorig9Head",
    "mixamorig9LeftUpLeg",      "mixamorig9LeftLeg",       "mixamorig9LeftFoot",
    "mixamorig9LeftToeBase",    "mixamorig9RightUpLeg",    "mixamorig9RightLeg",
    "mixamorig9RightFoot",      "mixamorig9RightToeBase",  "mixamorig9LeftShoulder",
    "mixamorig9LeftArm",        "mixamorig9LeftForeArm",   "mixamorig9LeftHand",
    "mixamorig9LeftHandIndex1", "mixamorig9RightShoulder", "mixamorig9RightArm",
    "mixamorig9RightForeArm",   "mixamorig9RightHand",     "mixamorig9RightHandIndex1"};
static const char *const cmu[BIPED_JOINTS] = {
    "Hips",           "LowerBack",     "Spine",        "Spine1",       "Neck",        "Head",
    "LeftUpLeg",      "LeftLeg",       "LeftFoot",     "LeftToeBase",  "RightUpLeg",  "RightLeg",
    "RightFoot",      "RightToeBase",  "LeftShoulder", "LeftArm",      "LeftForeArm", "LeftHand",
    "LeftHandIndex1", "RightShoulder", "RightArm",     "RightForeArm", "RightHand",   "RightHandIndex1"};
static const char *const asf[BIPED_JOINTS] = {
    "root",    "lowerback", "upperback", "thorax",    "lowerneck", "head",    "lfemur",    "ltibia",
    "lfoot",   "ltoes",     "rfemur",    "rtibia",    "rfoot",     "rtoes",   "lclavicle", "lhumerus",
    "lradius", "lwrist",    "lindex",    "rclavicle", "rhumerus",  "rradius", "rwrist",    "rindex"};
static const char *const anatomy[BIPED_JOINTS] = {
    "Hips",       "Chest",       "Chest2",        "Chest3",       "Neck",       "Head",
    "LeftHip",    "LeftKnee",    "LeftAnkle",     "LeftToe",      "RightHip",   "RightKnee",
    "RightAnkle", "RightToe",    "LeftCollar",    "LeftShoulder", "LeftElbow",  "LeftWrist",
    "LeftIndex",  "RightCollar", "RightShoulder", "RightElbow",   "RightWrist", "RightIndex"};
static const char *const rigify[BIPED_JOINTS] = {
    "DEF-spine",       "DEF-spine.001", "DEF-spine.002", "DEF-spine.003",    "DEF-spine.004",
    "DEF-spine.006",   "DEF-thigh.L",   "DEF-shin.L",    "DEF-foot.L",       "DEF-toe.L",
    "DEF-thigh.R",     "DEF-shin.R",    "DEF-foot.R",    "DEF-toe.R",        "DEF-shoulder.L",
    "DEF-upper_arm.L", "DEF-forearm.L", "DEF-hand.L",    "DEF-f_index.01.L", "DEF-shoulder.R",
    "DEF-upper_arm.R", "DEF-forearm.R", "DEF-hand.R",    "DEF-f_index.01.R"};
static const char *const unreal[BIPED_JOINTS] = {
    "pelvis",     "spine_01",   "spine_02",   "spine_03",   "neck_01",    "head",
    "thigh_l",    "calf_l",     "foot_l",     "ball_l",     "thigh_r",    "calf_r",
    "foot_r",     "ball_r",     "clavicle_l", "upperarm_l", "lowerarm_l", "hand_l",
    "index_01_l", "clavicle_r", "upperarm_r", "lowerarm_r", "hand_r",     "index_01_r"};
static const char *const makehuman[BIPED_JOINTS] = {
    "root",         "spine05",      "spine03",      "spine01",      "neck01",       "head",
    "upperleg01.L", "lowerleg01.L", "foot.L",       "toe.L",        "upperleg01.R", "lowerleg01.R",
    "foot.R",       "toe.R",        "clavicle.L",   "upperarm01.L", "lowerarm01.L", "wrist.L",
    "finger2-1.L",  "clavicle.R",   "upperarm01.R", "lowerarm01.R", "wrist.R",      "finger2-1.R"};
static const char *const unity[BIPED_JOINTS] = {"Hips",
                                                "Spine",
                                                "Chest",
                                                "UpperChest",
                                                "Neck",
                                                "Head",
                                                "LeftUpperLeg",
                                                "LeftLowerLeg",
                                                "LeftFoot",
                                                "LeftToes",
                                                "RightUpperLeg",
                                                "RightLowerLeg",
                                                "RightFoot",
                                                "RightToes",
                                                "LeftShoulder",
                                                "LeftUpperArm",
                                                "LeftLowerArm",
                                                "LeftHand",
                                                "Left Index Proximal",
                                                "RightShoulder",
                                                "RightUpperArm",
                                                "RightLowerArm",
                                                "RightHand",
                                                "Right Index Proximal"};
static const char *const vroid[BIPED_JOINTS] = {
    "J_Bip_C_Hips",     "J_Bip_C_Spine",    "J_Bip_C_Chest",    "J_Bip_C_UpperChest", "J_Bip_C_Neck",
    "J_Bip_C_Head",     "J_Bip_L_UpperLeg", "J_Bip_L_LowerLeg", "J_Bip_L_Foot",       "J_Bip_L_ToeBase",
    "J_Bip_R_UpperLeg", "J_Bip_R_LowerLeg", "J_Bip_R_Foot",     "J_Bip_R_ToeBase",    "J_Bip_L_Shoulder",
    "J_Bip_L_UpperArm", "J_Bip_L_LowerArm", "J_Bip_L_Hand",     "J_Bip_L_Index1",     "J_Bip_R_Shoulder",
    "J_Bip_R_UpperArm", "J_Bip_R_LowerArm", "J_Bip_R_Hand",     "J_Bip_R_Index1"};
static const char *const max_biped[BIPED_JOINTS] = {
    "Bip01 Pelvis",     "Bip01 Spine",     "Bip01 Spine1", "Bip01 Spine2",    "Bip01 Neck",
    "Bip01 Head",       "Bip01 L Thigh",   "Bip01 L Calf", "Bip01 L Foot",    "Bip01 L Toe0",
    "Bip01 R Thigh",    "Bip01 R Calf",    "Bip01 R Foot", "Bip01 R Toe0",    "Bip01 L Clavicle",
    "Bip01 L UpperArm", "Bip01 L Forearm", "Bip01 L Hand", "Bip01 L Finger1", "Bip01 R Clavicle",
    "Bip01 R UpperArm", "Bip01 R Forearm", "Bip01 R Hand", "Bip01 R Finger1"};
static const char *const smpl[BIPED_JOINTS] = {
    "Pelvis",  "Spine1",  "Spine2",   "Spine3",   "Neck",       "Head",    "L_Hip",    "L_Knee",
    "L_Ankle", "L_Foot",  "R_Hip",    "R_Knee",   "R_Ankle",    "R_Foot",  "L_Collar", "L_Shoulder",
    "L_Elbow", "L_Wrist", "L_Index1", "R_Collar", "R_Shoulder", "R_Elbow", "R_Wrist",  "R_Index1"};
static const char *const daz[BIPED_JOINTS] = {
    "hip",      "abdomen", "abdomen2", "chest",   "neck",   "head",     "lThigh",  "lShin",
    "lFoot",    "lToe",    "rThigh",   "rShin",   "rFoot",  "rToe",     "lCollar", "lShldr",
    "lForeArm", "lHand",   "lIndex1",  "rCollar", "rShldr", "rForeArm", "rHand",   "rIndex1"};
static const char *const creator[BIPED_JOINTS] = {
    "CC_Base_Hip",        "CC_Base_Waist",     "CC_Base_Spine01", "CC_Base_Spine02",   "CC_Base_NeckTwist01",
    "CC_Base_Head",       "CC_Base_L_Thigh",   "CC_Base_L_Calf",  "CC_Base_L_Foot",    "CC_Base_L_ToeBase",
    "CC_Base_R_Thigh",    "CC_Base_R_Calf",    "CC_Base_R_Foot",  "CC_Base_R_ToeBase", "CC_Base_L_Clavicle",
    "CC_Base_L_Upperarm", "CC_Base_L_Forearm", "CC_Base_L_Hand",  "CC_Base_L_Index1",  "CC_Base_R_Clavicle",
    "CC_Base_R_Upperarm", "CC_Base_R_Forearm", "CC_Base_R_Hand",  "CC_Base_R_Index1"};

static const char *const auto_rig[BIPED_JOINTS] = {
    "root.x",          "spine_01.x",        "spine_02.x",    "spine_03.x", "neck.x",
    "head.x",          "thigh_stretch.l",   "leg_stretch.l", "foot.l",     "toes_01.l",
    "thigh_stretch.r", "leg_stretch.r",     "foot.r",        "toes_01.r",  "shoulder.l",
    "arm_stretch.l",   "forearm_stretch.l", "hand.l",        "c_index1.l", "shoulder.r",
    "arm_stretch.r",   "forearm_stretch.r", "hand.r",        "c_index1.r"};
static const char *const advanced[BIPED_JOINTS] = {
    "Root_M",         "Spine1_M",  "Spine2_M",   "Chest_M",    "Neck_M",  "Head_M",
    "Hip_L",          "Knee_L",    "Ankle_L",    "Toes_L",     "Hip_R",   "Knee_R",
    "Ankle_R",        "Toes_R",    "Scapula_L",  "Shoulder_L", "Elbow_L", "Wrist_L",
    "IndexFinger1_L", "Scapula_R", "Shoulder_R", "Elbow_R",    "Wrist_R", "IndexFinger1_R"};
static const char *const joints[BIPED_JOINTS] = {
    "hip_jnt",        "spine_01_jnt",  "spine_02_jnt", "spine_03_jnt",   "neck_jnt",
    "head_jnt",       "l_thigh_jnt",   "l_calf_jnt",   "l_foot_jnt",     "l_toe_jnt",
    "r_thigh_jnt",    "r_calf_jnt",    "r_foot_jnt",   "r_toe_jnt",      "l_clavicle_jnt",
    "l_upperarm_jnt", "l_forearm_jnt", "l_hand_jnt",   "l_index_01_jnt", "r_clavicle_jnt",
    "r_upperarm_jnt", "r_forearm_jnt", "r_hand_jnt",   "r_index_01_jnt"};
static const char *const neuron[BIPED_JOINTS] = {
    "Robot_Hips",        "Robot_Spine",        "Robot_Spine1",         "Robot_Spine2",
    "Robot_Neck",        "Robot_Head",         "Robot_LeftUpLeg",      "Robot_LeftLeg",
    "Robot_LeftFoot",    "Robot_LeftToe",      "Robot_RightUpLeg",     "Robot_RightLeg",
    "Robot_RightFoot",   "Robot_RightToe",     "Robot_LeftShoulder",   "Robot_LeftArm",
    "Robot_LeftForeArm", "Robot_LeftHand",     "Robot_LeftHandIndex1", "Robot_RightShoulder",
    "Robot_RightArm",    "Robot_RightForeArm", "Robot_RightHand",      "Robot_RightHandIndex1"};

/* The upper chest is no bone of theirs. */
static const char *const motive[BIPED_JOINTS] = {
    "Skeleton1:Hip",    "Skeleton1:Ab",     "Skeleton1:Chest", "upperChest",        "Skeleton1:Neck",
    "Skeleton1:Head",   "Skeleton1:LThigh", "Skeleton1:LShin", "Skeleton1:LFoot",   "Skeleton1:LToe",
    "Skeleton1:RThigh", "Skeleton1:RShin",  "Skeleton1:RFoot", "Skeleton1:RToe",    "Skeleton1:LShoulder",
    "Skeleton1:LUArm",  "Skeleton1:LFArm",  "Skeleton1:LHand", "Skeleton1:LIndex1", "Skeleton1:RShoulder",
    "Skeleton1:RUArm",  "Skeleton1:RFArm",  "Skeleton1:RHand", "Skeleton1:RIndex1"};

/* Nor are collar bones and fingers. */
static const char *const kinect[BIPED_JOINTS] = {
    "SpineBase",  "SpineMid",    "SpineShoulder", "upperChest",   "Neck",       "Head",
    "HipLeft",    "KneeLeft",    "AnkleLeft",     "FootLeft",     "HipRight",   "KneeRight",
    "AnkleRight", "FootRight",   "LeftCollar",    "ShoulderLeft", "ElbowLeft",  "WristLeft",
    "LeftIndex1", "RightCollar", "ShoulderRight", "ElbowRight",   "WristRight", "RightIndex1"};

static const char *const xsens[BIPED_JOINTS] = {
    "Pelvis",        "L5",           "T12",           "T8",
    "Neck",          "Head",         "LeftUpperLeg",  "LeftLowerLeg",
    "LeftFoot",      "LeftToe",      "RightUpperLeg", "RightLowerLeg",
    "RightFoot",     "RightToe",     "LeftShoulder",  "LeftUpperArm",
    "LeftForeArm",   "LeftHand",     "LeftIndex1",    "RightShoulder",
    "RightUpperArm", "RightForeArm", "RightHand",     "RightIndex1"};
static const char *const biovision[BIPED_JOINTS] = {
    "hips",      "chest",       "chest2",     "chest3",      "neck",       "head",
    "leftupleg", "leftlowleg",  "leftfoot",   "lefttoe",     "rightupleg", "rightlowleg",
    "rightfoot", "righttoe",    "leftcollar", "leftuparm",   "leftlowarm", "lefthand",
    "leftindex", "rightcollar", "rightuparm", "rightlowarm", "righthand",  "rightindex"};

static const char *const rokoko[BIPED_JOINTS] = {"Hips",
                                                 "Spine1",
                                                 "Spine2",
                                                 "Spine4",
                                                 "Neck",
                                                 "Head",
                                                 "LeftThigh",
                                                 "LeftShin",
                                                 "LeftFoot",
                                                 "LeftToe",
                                                 "RightThigh",
                                                 "RightShin",
                                                 "RightFoot",
                                                 "RightToe",
                                                 "LeftShoulder",
                                                 "LeftArm",
                                                 "LeftForeArm",
                                                 "LeftHand",
                                                 "LeftFinger2Proximal",
                                                 "RightShoulder",
                                                 "RightArm",
                                                 "RightForeArm",
                                                 "RightHand",
                                                 "RightFinger2Proximal"};
static const char *const arkit[BIPED_JOINTS] = {
    "hips_joint",         "spine_1_joint",       "spine_4_joint",          "spine_7_joint",
    "neck_1_joint",       "head_joint",          "left_upLeg_joint",       "left_leg_joint",
    "left_foot_joint",    "left_toes_joint",     "right_upLeg_joint",      "right_leg_joint",
    "right_foot_joint",   "right_toes_joint",    "left_shoulder_1_joint",  "left_arm_joint",
    "left_forearm_joint", "left_hand_joint",     "left_handIndex_1_joint", "right_shoulder_1_joint",
    "right_arm_joint",    "right_forearm_joint", "right_hand_joint",       "right_handIndex_1_joint"};
static const char *const azure[BIPED_JOINTS] = {
    "PELVIS",      "SPINE_NAVEL",    "SPINE_CHEST",    "upperChest",    "NECK",        "HEAD",
    "HIP_LEFT",    "KNEE_LEFT",      "ANKLE_LEFT",     "FOOT_LEFT",     "HIP_RIGHT",   "KNEE_RIGHT",
    "ANKLE_RIGHT", "FOOT_RIGHT",     "CLAVICLE_LEFT",  "SHOULDER_LEFT", "ELBOW_LEFT",  "WRIST_LEFT",
    "LeftIndex1",  "CLAVICLE_RIGHT", "SHOULDER_RIGHT", "ELBOW_RIGHT",   "WRIST_RIGHT", "RightIndex1"};
static const char *const vrchat[BIPED_JOINTS] = {
    "Hips",           "Spine",          "Chest",         "Upper Chest", "Neck",        "Head",
    "Left leg",       "Left knee",      "Left ankle",    "Left toe",    "Right leg",   "Right knee",
    "Right ankle",    "Right toe",      "Left shoulder", "Left arm",    "Left elbow",  "Left wrist",
    "IndexFinger1_L", "Right shoulder", "Right arm",     "Right elbow", "Right wrist", "IndexFinger1_R"};
static const char *const mmd[BIPED_JOINTS] = {
    "センター", "上半身",   "上半身2",  "上半身3", "首",     "頭",       "左足",   "左ひざ",
    "左足首",   "左つま先", "右足",     "右ひざ",  "右足首", "右つま先", "左肩",   "左腕",
    "左ひじ",   "左手首",   "左人指１", "右肩",    "右腕",   "右ひじ",   "右手首", "右人指１"};
static const char *const mmd_blender[BIPED_JOINTS] = {
    "センター", "上半身",   "上半身2",  "上半身3", "首",     "頭",       "足.L",   "ひざ.L",
    "足首.L",   "つま先.L", "足.R",     "ひざ.R",  "足首.R", "つま先.R", "肩.L",   "腕.L",
    "ひじ.L",   "手首.L",   "人指１.L", "肩.R",    "腕.R",   "ひじ.R",   "手首.R", "人指１.R"};
/* With the same word and separator in front. */
static const char *const somebody[BIPED_JOINTS] = {
    "Bob_A_Hips",        "Bob_A_Spine",        "Bob_A_Spine1",         "Bob_A_Spine2",
    "Bob_A_Neck",        "Bob_A_Head",         "Bob_A_LeftUpLeg",      "Bob_A_LeftLeg",
    "Bob_A_LeftFoot",    "Bob_A_LeftToeBase",  "Bob_A_RightUpLeg",     "Bob_A_RightLeg",
    "Bob_A_RightFoot",   "Bob_A_RightToeBase", "Bob_A_LeftShoulder",   "Bob_A_LeftArm",
    "Bob_A_LeftForeArm", "Bob_A_LeftHand",     "Bob_A_LeftHandIndex1", "Bob_A_RightShoulder",
    "Bob_A_RightArm",    "Bob_A_RightForeArm", "Bob_A_RightHand",      "Bob_A_RightHandIndex1"};
/* With a number behind each name. */
static const char *const sketchfab[BIPED_JOINTS] = {
    "Bip01 Pelvis_01",      "Bip01 Spine_02",      "Bip01 Spine1_03",      "Bip01 Spine2_04",
    "Bip01 Neck_05",        "Bip01 Head_06",       "Bip01 L Thigh_07",     "Bip01 L Calf_08",
    "Bip01 L Foot_09",      "Bip01 L Toe0_010",    "Bip01 R Thigh_011",    "Bip01 R Calf_012",
    "Bip01 R Foot_013",     "Bip01 R Toe0_014",    "Bip01 L Clavicle_015", "Bip01 L UpperArm_016",
    "Bip01 L Forearm_017",  "Bip01 L Hand_018",    "Bip01 L Finger1_019",  "Bip01 R Clavicle_020",
    "Bip01 R UpperArm_021", "Bip01 R Forearm_022", "Bip01 R Hand_023",     "Bip01 R Finger1_024"};

static const char *const *const families[] = {
    NULL,      mixamo, numbered, cmu,     asf,      anatomy,  rigify,      unreal,   makehuman, unity,  vroid,
    max_biped, smpl,   daz,      creator, auto_rig, advanced, joints,      neuron,   motive,    kinect, xsens,
    biovision, rokoko, arkit,    azure,   vrchat,   mmd,      mmd_blender, somebody, sketchfab};
enum { FAMILIES = sizeof families / sizeof *families };

#endif
