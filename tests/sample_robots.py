"""Small robot files with what real ones hold: classes, degrees, several joints on a body, geoms."""

HUMANOID = """
<mujoco model="figure">
  <compiler eulerseq="xyz"/>
  <option gravity="0 0.5 -9.7"/>
  <default>
    <geom type="capsule" density="900"/>
    <joint damping="0.4" stiffness="3"/>
    <default class="stiff"><joint stiffness="20" damping="2" range="-90 30" limited="true"/></default>
  </default>
  <worldbody>
    <geom type="plane" size="1 1 0.1"/>
    <body name="torso" pos="0 0 1.3" euler="10 20 30">
      <freejoint/>
      <geom fromto="0 -0.1 0 0 0.12 0.02" size="0.07"/>
      <geom type="sphere" pos="0 0 0.19" size="0.09" mass="4"/>
      <body name="arm" pos="0 0.17 0.06" childclass="stiff">
        <joint name="lift" axis="2 1 1" pos="0.01 0.02 0.03"/>
        <joint name="arm joint" axis="0 -1 1" range="-60 80" pos="-0.02 0 0.01"/>
        <geom fromto="0 0 0 0.16 0.16 -0.16" size="0.04"/>
        <body name="hand" pos="0.18 0.18 -0.18" axisangle="1 0 1 25">
          <joint name="hand joint" type="slide" axis="1 0 0" range="-0.02 0.05" ref="0.01"/>
          <geom type="box" size="0.03 0.04 0.05" pos="0.01 0 0"/>
          <geom type="ellipsoid" size="0.02 0.03 0.04" zaxis="1 1 0"/>
        </body>
      </body>
      <body name="leg" pos="0 -0.1 -0.3" xyaxes="1 0.1 0 0 1 0.2">
        <joint name="leg joint" type="ball" stiffness="0"/>
        <inertial pos="0 0 -0.2" mass="5" fullinertia="0.1 0.12 0.03 0.01 0.002 -0.003"/>
        <geom type="cylinder" size="0.05 0.2"/>
        <body name="foot" pos="0 0 -0.4">
          <geom type="cylinder" fromto="0 0 0 0.2 0 0" size="0.03"/>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>
"""

URDF_ARM = """<?xml version="1.0"?>
<robot name="arm">
  <link name="world"/>
  <link name="upper">
    <inertial><origin xyz="0 0 0.2" rpy="0.1 0.2 0.3"/><mass value="2"/>
      <inertia ixx="0.03" iyy="0.04" izz="0.02" ixy="0.001" ixz="0.002" iyz="-0.003"/></inertial>
    <visual><geometry><sphere radius="0.1"/></geometry></visual>
  </link>
  <link name="slider">
    <inertial><mass value="0.5"/>
      <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
  <joint name="shoulder" type="revolute">
    <parent link="world"/><child link="upper"/><origin xyz="0 0.1 1" rpy="0.3 -0.2 0.5"/><axis xyz="0 1 0"/>
    <limit lower="-1.5" upper="0.75" effort="1" velocity="1"/><dynamics damping="0.3" friction="0.1"/>
  </joint>
  <joint name="slide" type="prismatic">
    <parent link="upper"/><child link="slider"/><origin xyz="0 0 0.4"/><axis xyz="1 0 1"/>
    <limit lower="-0.1" upper="0.2" effort="1" velocity="1"/>
  </joint>
  <transmission name="t"/>
</robot>
"""
