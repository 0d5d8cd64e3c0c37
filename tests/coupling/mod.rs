mod small_joint;
mod truth;
