% Replaces the class of the Robotics System Toolbox.
classdef rigidBody < handle
    properties
        Name = '';
        Joint = [];
    end
    methods
        function self = rigidBody(name)
            self.Name = name;
            self.Joint = rigidBodyJoint([name '_jnt']);
        end
    end
end
