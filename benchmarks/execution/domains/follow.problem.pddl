(define (problem follow-and-report) (:domain follow)
  (:objects rover - host  person - class  cobalt - source
            eye thermal - camera  hog - detector  tracker - tracker  wheels - base
            head - pointer  crystal - sensor  voice - speaker
            eye-image thermal-image - image  found - detections  steering - twist)
  (:init (ready eye) (ready thermal) (ready hog) (ready tracker) (ready wheels) (ready head)
         (ready crystal) (ready voice)
         (on eye rover) (on thermal rover) (on hog rover) (on tracker rover) (on wheels rover)
         (on head rover) (on crystal rover) (on voice rover)
         (output eye eye-image) (output thermal thermal-image) (output hog found)
         (output tracker steering)
         (free eye-image) (free thermal-image) (free found) (free steering)
         (idle wheels) (idle head) (recognises hog person))
  (:goal (and (following rover person) (pointing rover cobalt) (reported person rover))))
